// What assimp reads, without its types.
#pragma once

#include <cstddef>
#include <string>

#include <glm/vec3.hpp>

namespace modar::testing {

/// Faces of three corners and more. Box of the vertices that they use, sum of the faces' areas
/// (half the length of Newell's vector). Positions are floats there.
struct SurfaceFigures {
  bool loaded = false;
  std::size_t faces = 0;
  std::size_t corners = 0;
  double area = 0;
  glm::dvec3 low{1e300};
  glm::dvec3 high{-1e300};
};

SurfaceFigures load_with_assimp(const std::string& path);

}  // namespace modar::testing
