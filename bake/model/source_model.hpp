// What a model file said, unrepaired.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "bake/report.hpp"

namespace modar {

/// A material as MTL or glTF names it. Paths are resolved against the file that names them, and
/// exist; empty where there is no map or it was not found (then there is a finding).
struct SourceMaterial {
  std::string name;
  glm::vec3 ambient{0.2f};
  glm::vec3 diffuse{0.8f};
  glm::vec3 specular{0.0f};
  glm::vec3 emission{0.0f};
  float shininess = 0.0f;
  float opacity = 1.0f;
  std::string diffuse_map;
  std::string alpha_map;
};

/// One corner of a face: indices into the arrays of the model, kNoIndex where it has none.
inline constexpr std::uint32_t kNoIndex = 0xFFFFFFFFu;
struct Corner {
  std::uint32_t position = kNoIndex;
  std::uint32_t uv = kNoIndex;
  std::uint32_t normal = kNoIndex;
};

/// Smoothing of faces in a file that says nothing of it: as one group of their own.
inline constexpr std::uint32_t kUnstatedSmoothing = 0xFFFFFFFFu;

/// Polygons of the file: face f has the corners [first_corner[f], first_corner[f + 1]), uses
/// material face_material[f] (index into materials; 0 is a default material where the file names
/// none) and smoothing group face_smoothing[f] (0: off; kUnstatedSmoothing: the file does not say).
struct SourceModel {
  std::string name;  ///< the file's stem
  std::vector<glm::dvec3> positions;
  std::vector<glm::vec3> colours;  ///< empty, or one a position, RGB in [0,1]
  std::vector<glm::dvec2> uvs;     ///< v up, as OBJ has it
  std::vector<glm::dvec3> normals;
  std::vector<Corner> corners;
  std::vector<std::uint32_t> first_corner;  ///< faces + 1 entries
  std::vector<std::uint32_t> face_material;
  std::vector<std::uint32_t> face_smoothing;
  std::vector<SourceMaterial> materials;
  std::vector<Finding> findings;

  [[nodiscard]] std::size_t face_count() const {
    return first_corner.empty() ? 0 : first_corner.size() - 1;
  }
};

}  // namespace modar
