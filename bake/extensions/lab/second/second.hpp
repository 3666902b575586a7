// A second reader of models, as the formats' texts say, for the checker: none of its code is the
// bake's.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bake/check/source/second_model.hpp"

namespace modar::second {

struct Corner {
  int position = 0;
  int uv = -1;
  int normal = -1;
};

struct Face {
  std::vector<Corner> corners;
  std::uint32_t material = 0;
  int smoothing = -1;  ///< group; 0: flat; -1: the file states none
  glm::dvec3 colour{1};
};

/// What a file says, with its own numbers. uvs: v up.
struct Mesh {
  bool knows_colours = true;
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec3> colours;  ///< empty, or one a position
  std::vector<glm::dvec2> uvs;
  std::vector<glm::dvec3> normals;
  std::vector<Face> faces;
  std::vector<SecondMaterial> materials;
};

/// Nothing: the file is of a kind, has parts, or is larger than this reader knows.
std::optional<Mesh> read_obj(const std::string& path);
std::optional<Mesh> read_ply(const std::string& path);
std::optional<Mesh> read_stl(const std::string& path);
std::optional<Mesh> read_gltf(const std::string& path);

/// Reads by the ending. crease: degrees between faces above which edges are sharp where the file
/// has no normals and states no smoothing.
std::optional<SecondModel> read(const std::string& path, double crease);

/// Empty where it cannot be read.
std::string file_bytes(const std::string& path);
std::vector<std::string> words_of(std::string_view line);
/// A line without its end, and "\" at it; false at the end of the text.
bool take_line(std::string_view& text, std::string& line);
/// Path of a file named in another one, or empty.
std::string named_file(const std::string& from, std::string name);
/// False where the bytes are no picture.
bool decode_picture(std::string_view bytes, RgbaImage& picture, Colours colours = Colours::kSrgb);

}  // namespace modar::second
