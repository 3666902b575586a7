// Interior orientation: default and scaled cameras, lens distortion both ways, and GL's projection.
#include "modar/camera.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace modar {
namespace {

// The iteration gains a digit or two a step with lenses of phones; the bound is for extreme ones.
constexpr int kUndistortSteps = 50;
constexpr double kUndistortPrecision = 1e-12;  // normalised image units

bool has_distortion(const Camera& camera) {
  return std::any_of(camera.distortion.begin(), camera.distortion.end(),
                     [](double k) { return k != 0.0; });
}

/// Ideal to distorted point on the plane z = 1 (Brown-Conrady).
glm::dvec2 distort(const Camera& camera, glm::dvec2 point) {
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  const double r2 = glm::dot(point, point);
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double xy = point.x * point.y;
  return {point.x * radial + 2.0 * p1 * xy + p2 * (r2 + 2.0 * point.x * point.x),
          point.y * radial + p1 * (r2 + 2.0 * point.y * point.y) + 2.0 * p2 * xy};
}

}  // namespace

Camera default_camera(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = std::max(width, height);
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

Camera scaled_camera(const Camera& camera, int width, int height) {
  if (camera.width <= 0 || camera.height <= 0) return default_camera(width, height);
  // The larger factor fills the new frame; the excess on the other axis is cropped on both sides.
  const double scale = std::max(static_cast<double>(width) / camera.width,
                                static_cast<double>(height) / camera.height);
  Camera scaled = camera;
  scaled.width = width;
  scaled.height = height;
  scaled.fx = camera.fx * scale;
  scaled.fy = camera.fy * scale;
  // Pixel centres are integers, so a pixel's edge is half a pixel before its centre.
  scaled.cx = (camera.cx + 0.5) * scale - 0.5 - 0.5 * (camera.width * scale - width);
  scaled.cy = (camera.cy + 0.5) * scale - 0.5 - 0.5 * (camera.height * scale - height);
  return scaled;
}

glm::dvec2 undistort(const Camera& camera, glm::dvec2 pixel) {
  if (!has_distortion(camera)) return pixel;
  const glm::dvec2 seen{(pixel.x - camera.cx) / camera.fx, (pixel.y - camera.cy) / camera.fy};
  const auto& [k1, k2, p1, p2, k3] = camera.distortion;
  glm::dvec2 ideal = seen;
  for (int step = 0; step < kUndistortSteps; ++step) {
    const double r2 = glm::dot(ideal, ideal);
    const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    // Beyond the turning point of the lens model no undistorted pixel exists: returns the input.
    if (!(radial > 0.0)) return pixel;
    const double xy = ideal.x * ideal.y;
    const glm::dvec2 tangential{2.0 * p1 * xy + p2 * (r2 + 2.0 * ideal.x * ideal.x),
                                p1 * (r2 + 2.0 * ideal.y * ideal.y) + 2.0 * p2 * xy};
    const glm::dvec2 next = (seen - tangential) / radial;
    const glm::dvec2 change = glm::abs(next - ideal);
    ideal = next;
    if (change.x < kUndistortPrecision && change.y < kUndistortPrecision) break;
  }
  return {ideal.x * camera.fx + camera.cx, ideal.y * camera.fy + camera.cy};
}

glm::dvec2 project(const Camera& camera, glm::dvec3 point) {
  const glm::dvec2 seen = distort(camera, glm::dvec2(point) / point.z);
  return {seen.x * camera.fx + camera.cx, seen.y * camera.fy + camera.cy};
}

glm::mat4 gl_projection(const Camera& camera, double near_plane, double far_plane) {
  // M_Persp: GL's camera axes to homogeneous pixels measured from the frame's top-left edge (v
  // down) with a third coordinate that keeps depth's order. GLM stores columns.
  const double u0 = camera.cx + 0.5;
  const double v0 = camera.cy + 0.5;
  glm::dmat4 persp(0.0);
  persp[0][0] = camera.fx;
  persp[1][1] = -camera.fy;
  persp[2] = {-u0, -v0, near_plane + far_plane, -1.0};
  persp[3][2] = near_plane * far_plane;
  // NDC: the box [0, width] x [0, height] x [near, far] to GL's unit box.
  const double depth = far_plane - near_plane;
  glm::dmat4 ndc(1.0);
  ndc[0][0] = 2.0 / camera.width;
  ndc[1][1] = -2.0 / camera.height;
  ndc[2][2] = -2.0 / depth;
  ndc[3] = {-1.0, 1.0, -(far_plane + near_plane) / depth, 1.0};
  return glm::mat4(ndc * persp);
}

}  // namespace modar
