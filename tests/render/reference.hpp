// What a pixel shows, by casting a ray through its centre in double precision against every
// triangle: no GL, no rasteriser, none of our matrices.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "modar/camera.hpp"
#include "tests/render/scene.hpp"

namespace modar {

/// A triangle in GL eye space (x right, y up, z backward).
struct EyeTriangle {
  std::array<glm::dvec3, 3> corners;
  bool two_sided = true;
};

std::vector<EyeTriangle> to_eye_space(std::span<const Triangle> triangles, const glm::dmat4& to_eye,
                                      bool two_sided);

struct Hit {
  int triangle = -1;     ///< -1: background
  bool certain = false;  ///< the same triangle all around the pixel's centre, well before the next
  glm::dvec3 weights{0.0};  ///< of its corners
};

/// One hit a pixel, top row first.
std::vector<Hit> cast_rays(const Camera& camera, std::span<const EyeTriangle> triangles);

}  // namespace modar
