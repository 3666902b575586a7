// Plane maps of poses and homographies, and the pose that explains points best.
#include "plane_map.hpp"

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar::tracker {
namespace {

constexpr double kSmallestArea = 300.0;  // square pixels

/// The pose whose plane leans the other way about the line of sight to the pattern's centre.
Pose mirrored(const Pose& pose) {
  const glm::dvec3 sight = glm::normalize(pose.translation);
  const glm::dvec3 normal = pose.rotation[2];
  const glm::dvec3 axis = glm::cross(normal, sight);
  const double sine = glm::length(axis);
  if (sine < 1e-9) return pose;
  // The face looks against the line of sight: turn the normal through it to the other side.
  const double angle = std::atan2(sine, -glm::dot(normal, sight));
  Pose other = pose;
  other.rotation = rotation_matrix(-2.0 * angle / sine * axis) * pose.rotation;
  return other;
}

/// Pixels; corners clockwise on the screen.
double area_of(const std::array<glm::dvec2, 4>& corners) {
  double area = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 a = corners[i];
    const glm::dvec2 b = corners[(i + 1) % 4];
    area += 0.5 * (a.x * b.y - b.x * a.y);
  }
  return area;
}

}  // namespace

glm::dvec2 PlaneMap::at(glm::dvec2 pixel, bool& ahead) const {
  const glm::dvec3 p = homography * glm::dvec3(pixel, 1.0);
  ahead = p.z > 1e-12;
  if (!ahead) return {0.0, 0.0};
  const glm::dvec2 ideal = glm::dvec2(p) / p.z;
  if (lens == nullptr) return ideal;
  return project(*lens, {(ideal.x - lens->cx) / lens->fx, (ideal.y - lens->cy) / lens->fy, 1.0});
}

glm::dmat2 PlaneMap::derivative(glm::dvec2 pixel) const {
  const glm::dvec3 p = homography * glm::dvec3(pixel, 1.0);
  const double inverse = 1.0 / p.z;
  const glm::dvec2 at = glm::dvec2(p) * inverse;
  glm::dmat2 d;
  d[0] = (glm::dvec2(homography[0]) - at * homography[0].z) * inverse;
  d[1] = (glm::dvec2(homography[1]) - at * homography[1].z) * inverse;
  return d;
}

const Camera* bending(const Camera& camera) {
  for (const double k : camera.distortion) {
    if (k != 0.0) return &camera;
  }
  return nullptr;
}

PlaneMap map_of_pose(const TrackedPattern& pattern, const Camera& camera, const Pose& pose) {
  glm::dmat3 k(1.0);
  k[0][0] = camera.fx;
  k[1][1] = camera.fy;
  k[2] = {camera.cx, camera.cy, 1.0};
  glm::dmat3 plane = pose.rotation;
  plane[2] = pose.translation;
  return {k * plane * pattern.world_from_pixels(), bending(camera)};
}

bool map_corners(const TrackedPattern& pattern, const PlaneMap& map,
                 std::array<glm::dvec2, 4>& corners) {
  const double right = pattern.width() - 0.5;
  const double bottom = pattern.height() - 0.5;
  const std::array<glm::dvec2, 4> image = {glm::dvec2{-0.5, -0.5}, glm::dvec2{right, -0.5},
                                           glm::dvec2{right, bottom}, glm::dvec2{-0.5, bottom}};
  for (std::size_t i = 0; i < 4; ++i) {
    bool ahead = false;
    corners[i] = map.at(image[i], ahead);
    if (!ahead || !std::isfinite(corners[i].x) || !std::isfinite(corners[i].y)) return false;
  }
  return true;
}

bool plausible(const std::array<glm::dvec2, 4>& corners) {
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 a = corners[i];
    const glm::dvec2 b = corners[(i + 1) % 4];
    const glm::dvec2 c = corners[(i + 2) % 4];
    // y points down: the order of the corners is clockwise on the screen.
    if (!((b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) > 0.0)) return false;
  }
  return area_of(corners) > kSmallestArea;
}

bool same_place(const std::array<glm::dvec2, 4>& a, const std::array<glm::dvec2, 4>& b) {
  const auto holds_middle = [](const std::array<glm::dvec2, 4>& outline,
                               const std::array<glm::dvec2, 4>& other) {
    const glm::dvec2 middle = 0.25 * (other[0] + other[1] + other[2] + other[3]);
    for (std::size_t i = 0; i < 4; ++i) {
      const glm::dvec2 from = outline[i];
      const glm::dvec2 side = outline[(i + 1) % 4] - from;
      if (side.x * (middle.y - from.y) - side.y * (middle.x - from.x) < 0.0) return false;
    }
    return true;
  };
  const double ratio = area_of(a) / area_of(b);
  return ratio > 0.5 && ratio < 2.0 && holds_middle(a, b) && holds_middle(b, a);
}

std::optional<Pose> nearest_pose(const TrackedPattern& pattern, const Camera& camera,
                                 const PlaneMap& map) {
  const auto pose =
      pose_from_homography(camera, map.homography * glm::inverse(pattern.world_from_pixels()));
  return pose ? std::optional(*pose) : std::nullopt;
}

int fit_poses(const TrackedPattern& pattern, const Camera& camera, const glm::dmat3& homography,
              const PlanePoints& points, std::array<Pose, 2>& poses) {
  const auto start = nearest_pose(pattern, camera, {homography, nullptr});
  if (!start) return 0;
  const Pose first = refine_pose(camera, points.world, points.ideal, *start);
  int count = 0;
  for (const Pose& pose :
       {first, refine_pose(camera, points.world, points.ideal, mirrored(first))}) {
    // The plane's face, not its back, must look at the camera.
    if (glm::dot(pose.rotation[2], pose.translation) < 0.0) {
      poses[static_cast<std::size_t>(count++)] = pose;
    }
  }
  return count;
}

}  // namespace modar::tracker
