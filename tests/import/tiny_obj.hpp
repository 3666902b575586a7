// tinyobjloader in doubles as an independent reader, its types kept out of the tests.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace modar::testing {

struct TinyCorner {
  int position = -1;
  int uv = -1;
  int normal = -1;
};

/// Polygons as the file has them (not triangulated).
struct TinyModel {
  bool loaded = false;
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec2> uvs;
  std::vector<glm::dvec3> normals;
  std::vector<TinyCorner> corners;
  std::vector<unsigned> face_sizes;
};

/// Whether tinyobjloader was there when the tests were built; without it nothing loads.
bool has_tinyobj();
TinyModel load_with_tinyobj(const std::string& path);

}  // namespace modar::testing
