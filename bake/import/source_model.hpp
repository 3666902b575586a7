// A model file's content, unrepaired.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "bake/import/source_clips.hpp"
#include "bake/memory/array.hpp"
#include "bake/report.hpp"
#include "bake/up_axis.hpp"
#include "formats/sections.hpp"

namespace modar {

/// Stored colour of surfaces without one. In the neutral room its brightest part is just not
/// clipped.
inline constexpr float kClay = 229.0f / 255.0f;

/// A picture of the directions in which a surface looks, about its own: red to rising u, green to
/// the picture's top, blue straight on.
struct NormalMap {
  std::string path;             ///< empty: none
  float scale = 1.0f;           ///< factor on red and green
  bool may_be_heights = false;  ///< MTL files name both alike: a grey picture is one of heights
  glm::dmat3 uv{1.0};           ///< from the base colour's uv, v down, to the map's
  TextureWrap wrap = kWrapRepeat;

  bool operator==(const NormalMap&) const = default;
};

/// Where a picture is on a surface, as an MTL's -s and -o say: uv * scale + offset, v up.
struct MapPlace {
  glm::dvec2 scale{1.0};
  glm::dvec2 offset{0.0};

  bool operator==(const MapPlace&) const = default;
};

/// A material of an MTL or glTF file. Map paths are resolved against the file that names them and
/// exist; empty where there is no map, or where it was not found (then there is a diagnostic).
struct SourceMaterial {
  std::string name;
  glm::vec3 ambient{0.2f};
  glm::vec3 diffuse{kClay};
  glm::vec3 specular{0.0f};  ///< where there is metalness, before its colour
  glm::vec3 emission{0.0f};
  float shininess = 0.0f;
  float reflectance = 0.0f;  ///< part of the light that it mirrors straight on, 0 to 1
  float metalness = 0.0f;    ///< 1: mirrors its colour's part, and scatters nothing
  float opacity = 1.0f;
  std::string diffuse_map;
  std::uint32_t beyond = kTextureRepeat;  ///< its TextureFlags where uvs leave [0,1]
  std::string alpha_map;
  MapPlace place;  ///< of the diffuse map; readers apply it to the uvs
  NormalMap normal;
  bool two_sided = false;
  bool sides_stated = false;  ///< its format says whether it is two-sided
  bool whitened = false;      ///< its file states a gray for its picture, which is shown unchanged
  std::uint32_t part = 0xFFFFFFFFu;  ///< of SourceMovement, whose faces it has; else nothing moves
  bool see_through = false;  ///< its picture has alpha; unknown (false) until it has been read
  /// Named "occluder": represents a real object, hides content behind it and is invisible itself.
  [[nodiscard]] bool occluder() const { return name == "occluder"; }
  std::shared_ptr<const void> keeper;  ///< owner of temporary files that hold the maps, or null
};

/// One corner of a face: indices into the arrays of the model, kNoIndex where it has none.
inline constexpr std::uint32_t kNoIndex = 0xFFFFFFFFu;
struct Corner {
  std::uint32_t position = kNoIndex;
  std::uint32_t uv = kNoIndex;
  std::uint32_t normal = kNoIndex;
};

/// Smoothing group of faces in a file that states none: they smooth as one group.
inline constexpr std::uint32_t kUnstatedSmoothing = 0xFFFFFFFFu;

/// The uv or normal index of every corner. Most files omit an attribute or repeat the position's
/// index throughout; then nothing is stored.
struct IndexPlane {
  enum class Kind : std::uint8_t { kAbsent, kSame, kOwn };
  Kind kind = Kind::kAbsent;
  Array<std::uint32_t> own;  ///< of kOwn

  [[nodiscard]] std::uint32_t at(std::size_t corner, std::uint32_t position) const {
    return kind == Kind::kOwn ? own[corner] : (kind == Kind::kSame ? position : kNoIndex);
  }
};

/// Faces from `first_face` up to the next run have `value`.
struct FaceRun {
  std::uint64_t first_face = 0;
  std::uint32_t value = 0;
};

/// Polygons of the file: face f has face_size(f) corners, starting at face_first(f). material_runs
/// hold indices into materials (0 is a default material where the file names none), smoothing_runs
/// smoothing groups (0: off; kUnstatedSmoothing: not stated); both are ascending and start at
/// face 0.
struct SourceModel {
  std::string name;  ///< the file's stem
  Upright up;        ///< as the format or a comment says it, else the usual one of the format
  Array<glm::dvec3> positions;
  Array<glm::vec3> colours;  ///< empty, or one a position, RGB in [0,1]
  Array<glm::dvec2> uvs;     ///< v up, as OBJ has it
  Array<glm::vec3> normals;
  Array<std::uint32_t> corner_positions;
  IndexPlane corner_uvs;
  IndexPlane corner_normals;
  Array<std::uint32_t> first_corner;  ///< faces + 1 entries; empty where all faces are triangles
  std::vector<FaceRun> material_runs;
  std::vector<FaceRun> smoothing_runs;
  std::vector<SourceMaterial> materials;
  SourceMovement movement;          ///< without clips empty
  Array<VertexBones> vertex_bones;  ///< one a position where a part has several bones, else empty
  std::vector<Diagnostic> diagnostics;
  std::uint64_t lost_faces = 0;  ///< that the file states and the reader could not use
  Account account;               ///< weld() adds faces and unused materials
  /// Other files that the model's own one names, those that are missing too; maps are in the
  /// materials, and here where they are missing.
  std::vector<std::string> files;

  [[nodiscard]] std::size_t corner_count() const { return corner_positions.size(); }
  [[nodiscard]] Corner corner(std::size_t i) const {
    const std::uint32_t p = corner_positions[i];
    return {p, corner_uvs.at(i, p), corner_normals.at(i, p)};
  }
  [[nodiscard]] std::size_t face_count() const {
    return first_corner.empty() ? corner_count() / 3 : first_corner.size() - 1;
  }
  [[nodiscard]] std::size_t face_first(std::size_t f) const {
    return first_corner.empty() ? 3 * f : first_corner[f];
  }
  [[nodiscard]] std::size_t face_size(std::size_t f) const {
    return first_corner.empty() ? 3 : first_corner[f + 1] - first_corner[f];
  }
};

/// Walks runs along rising face numbers.
class RunCursor {
 public:
  explicit RunCursor(const std::vector<FaceRun>& runs) : runs_(runs) {}
  /// The value of `face`, which must not be lower than in the previous call; 0 without runs.
  std::uint32_t at(std::size_t face) {
    while (next_ < runs_.size() && runs_[next_].first_face <= face) value_ = runs_[next_++].value;
    return value_;
  }

 private:
  const std::vector<FaceRun>& runs_;
  std::size_t next_ = 0;
  std::uint32_t value_ = 0;
};

}  // namespace modar
