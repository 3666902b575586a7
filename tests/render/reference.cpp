// What a pixel shows, by casting a ray through its centre in double precision.
#include "tests/render/reference.hpp"

#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

namespace modar {
namespace {

struct Nearest {
  int triangle = -1;
  double depth = std::numeric_limits<double>::infinity();
  double second = std::numeric_limits<double>::infinity();
  glm::dvec3 weights{0.0};
};

/// Depth along the ray, or a negative number where it misses.
double intersect(const EyeTriangle& triangle, const glm::dvec3& ray, glm::dvec3& weights) {
  const auto& [a, b, c] = triangle.corners;
  const glm::dvec3 ab = b - a;
  const glm::dvec3 ac = c - a;
  const glm::dvec3 normal = glm::cross(ab, ac);
  const double facing = glm::dot(ray, normal);
  if (facing == 0.0 || (!triangle.two_sided && facing > 0.0)) return -1.0;
  const double depth = glm::dot(a, normal) / facing;
  if (depth <= 0.0) return -1.0;
  const glm::dvec3 offset = ray * depth - a;
  const double area = glm::dot(normal, normal);
  const double v = glm::dot(glm::cross(offset, ac), normal) / area;
  const double w = glm::dot(glm::cross(ab, offset), normal) / area;
  if (v < 0.0 || w < 0.0 || v + w > 1.0) return -1.0;
  weights = {1.0 - v - w, v, w};
  return depth;
}

Nearest nearest(const Camera& camera, double x, double y, std::span<const EyeTriangle> triangles) {
  const glm::dvec3 ray((x - camera.cx) / camera.fx, -(y - camera.cy) / camera.fy, -1.0);
  Nearest best;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    glm::dvec3 weights;
    const double depth = intersect(triangles[i], ray, weights);
    if (depth < 0.0) continue;
    if (depth < best.depth) {
      best.second = best.depth;
      best.depth = depth;
      best.triangle = static_cast<int>(i);
      best.weights = weights;
    } else if (depth < best.second) {
      best.second = depth;
    }
  }
  return best;
}

}  // namespace

std::vector<EyeTriangle> to_eye_space(std::span<const Triangle> triangles, const glm::dmat4& to_eye,
                                      bool two_sided) {
  std::vector<EyeTriangle> result;
  for (const Triangle& triangle : triangles) {
    EyeTriangle eye;
    eye.two_sided = two_sided;
    for (std::size_t i = 0; i < 3; ++i) {
      eye.corners[i] = glm::dvec3(to_eye * glm::dvec4(triangle.corners[i], 1.0));
    }
    result.push_back(eye);
  }
  return result;
}

std::vector<Hit> cast_rays(const Camera& camera, std::span<const EyeTriangle> triangles) {
  // Rasterisers snap corners to a fraction of a pixel: pixels this close to an edge are left open.
  constexpr double kMargin = 0.04;
  std::vector<Hit> hits;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Nearest centre = nearest(camera, x, y, triangles);
      Hit hit{centre.triangle, true, centre.weights};
      for (const glm::dvec2 step : {glm::dvec2(1, 1), {1, -1}, {-1, 1}, {-1, -1}}) {
        const Nearest beside =
            nearest(camera, x + kMargin * step.x, y + kMargin * step.y, triangles);
        const bool apart = !(beside.second < beside.depth * 1.001);
        hit.certain = hit.certain && beside.triangle == centre.triangle && apart;
      }
      hits.push_back(hit);
    }
  }
  return hits;
}

}  // namespace modar
