// Plane maps, poses from points, the motion model and the solver of normal equations.
#include "plane_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar::tracker {
namespace {

// Square pixels of a plausible outline. Smaller finds farther patterns and accepts clutter. [150,
// 600] tuned: wild
constexpr double kMinArea = 300.0;

/// Square pixels; positive for corners in clockwise order on the screen.
double area_of(const std::array<glm::dvec2, 4>& corners) {
  double area = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 a = corners[i];
    const glm::dvec2 b = corners[(i + 1) % 4];
    area += 0.5 * (a.x * b.y - b.x * a.y);
  }
  return area;
}

// Cosine between the sight and the normal of a curved pattern below which it shows nothing of use:
// within 11 degrees of the outline a patch reaches over it.
constexpr double kTurnedAway = 0.2;
constexpr double kInside = 1e-6;  // pixels
constexpr int kGrid = 8;          // places across and down at which a curved pattern is looked at

bool faces(const SurfacePoint& point, const glm::dvec3& eye) {
  const glm::dvec3 normal = glm::cross(vector_of(point.down), vector_of(point.right));
  const glm::dvec3 sight = eye - vector_of(point.at);
  const double along = glm::dot(normal, sight);
  return along > 0.0 && along * along > kTurnedAway * kTurnedAway * glm::dot(normal, normal) *
                                            glm::dot(sight, sight);
}

glm::dvec2 pixel_of(const glm::dvec3& p, const Camera* lens, bool& in_front) {
  in_front = p.z > 1e-12;
  if (!in_front) return {0.0, 0.0};
  const glm::dvec2 ideal = glm::dvec2(p) / p.z;
  if (lens == nullptr) return ideal;
  return project(*lens, {(ideal.x - lens->cx) / lens->fx, (ideal.y - lens->cy) / lens->fy, 1.0});
}

/// Frame pixels of a pattern's pixel there, by area.
double scale_at(const PlaneMap& map, glm::dvec2 pixel) {
  const glm::dmat2 d = map.derivative(pixel);
  return std::sqrt(std::abs(d[0].x * d[1].y - d[0].y * d[1].x));
}

/// Calls `take(pixel, frame pixel)` for the places of a curved pattern's grid that show.
template <class Take>
void visit_visible(const TrackedPattern& pattern, const PlaneMap& map, Take&& take) {
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const glm::dvec2 pixel{(i % kGrid + 0.5) / kGrid * pattern.width() - 0.5,
                           (static_cast<int>(i / kGrid) + 0.5) / kGrid * pattern.height() - 0.5};
    bool in_front = false;
    const glm::dvec2 at = map.at(pixel, in_front);
    if (in_front) take(pixel, at);
  }
}

}  // namespace

int nearest_octave(double scale) {
  int exponent = 0;
  const double part = std::frexp(scale, &exponent);  // 0.5 to 1
  return part * part < 0.5 ? exponent - 1 : exponent;
}

glm::dvec2 PlaneMap::at(glm::dvec2 pixel, bool& in_front, double mean_square) const {
  if (surface == nullptr) return pixel_of(homography * glm::dvec3(pixel, 1.0), lens, in_front);
  const SurfacePoint point = surface->at(pixel.x, pixel.y);
  in_front = false;
  if (!faces(point, eye)) return {0.0, 0.0};
  const glm::dvec3 middle = vector_of(point.at) + 0.5 * mean_square * vector_of(point.bend);
  return pixel_of(homography * middle + shift, lens, in_front);
}

glm::dvec2 PlaneMap::anywhere(glm::dvec2 pixel, bool& in_front) const {
  if (surface == nullptr) return at(pixel, in_front);
  const SurfacePoint point = surface->at(pixel.x, pixel.y);
  return pixel_of(homography * vector_of(point.at) + shift, lens, in_front);
}

glm::dmat2 PlaneMap::derivative(glm::dvec2 pixel) const {
  glm::dvec3 right = homography[0];
  glm::dvec3 down = homography[1];
  glm::dvec3 p{};
  if (surface == nullptr) {
    p = homography * glm::dvec3(pixel, 1.0);
  } else {
    const SurfacePoint point = surface->at(pixel.x, pixel.y);
    p = homography * vector_of(point.at) + shift;
    right = homography * vector_of(point.right);
    down = homography * vector_of(point.down);
  }
  const double inverse = 1.0 / p.z;
  const glm::dvec2 at = glm::dvec2(p) * inverse;
  glm::dmat2 d;
  d[0] = (glm::dvec2(right) - at * right.z) * inverse;
  d[1] = (glm::dvec2(down) - at * down.z) * inverse;
  return d;
}

const Camera* distorting_lens(const Camera& camera) {
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
  if (!pattern.surface.flat()) {
    return {k * pose.rotation, distorting_lens(camera), &pattern.surface, k * pose.translation,
            -(glm::transpose(pose.rotation) * pose.translation)};
  }
  glm::dmat3 plane = pose.rotation;
  plane[2] = pose.translation;
  return {k * plane * pattern.world_from_pixels(), distorting_lens(camera)};
}

double scale_of(const TrackedPattern& pattern, const PlaneMap& map) {
  if (map.surface == nullptr) {
    return scale_at(map, {0.5 * pattern.width(), 0.5 * pattern.height()});
  }
  double most = 0.0;
  visit_visible(pattern, map,
                [&](glm::dvec2 pixel, glm::dvec2) { most = std::max(most, scale_at(map, pixel)); });
  return most > 0.0 ? most : 1.0;
}

bool map_corners(const TrackedPattern& pattern, const PlaneMap& map,
                 std::array<glm::dvec2, 4>& corners) {
  const double right = pattern.width() - 0.5;
  const double bottom = pattern.height() - 0.5;
  std::array<glm::dvec2, 4> image = {glm::dvec2{-0.5, -0.5}, glm::dvec2{right, -0.5},
                                     glm::dvec2{right, bottom}, glm::dvec2{-0.5, bottom}};
  if (map.surface != nullptr && !map.surface->faces().empty()) {
    // A little inside of it: its border is the next face's, too.
    const auto& place = map.surface->faces()[0].place;
    const glm::dvec2 low{place[0] - 0.5, place[1] - 0.5};
    const glm::dvec2 high = low + glm::dvec2(place[2] - kInside, place[3] - kInside);
    image = {low, glm::dvec2{high.x, low.y}, high, glm::dvec2{low.x, high.y}};
  }
  for (std::size_t i = 0; i < 4; ++i) {
    bool in_front = false;
    corners[i] = map.anywhere(image[i], in_front);
    if (!in_front || !std::isfinite(corners[i].x) || !std::isfinite(corners[i].y)) return false;
  }
  return true;
}

bool plausible(const std::array<glm::dvec2, 4>& corners) {
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 a = corners[i];
    const glm::dvec2 b = corners[(i + 1) % 4];
    const glm::dvec2 c = corners[(i + 2) % 4];
    // y points down: the corners go clockwise on the screen.
    if (!((b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) > 0.0)) return false;
  }
  return area_of(corners) > kMinArea;
}

bool locate_corners(const TrackedPattern& pattern, const PlaneMap& map,
                    std::array<glm::dvec2, 4>& corners) {
  if (!map_corners(pattern, map, corners)) return false;
  if (map.surface == nullptr) return plausible(corners);
  constexpr int kMinPlaces = 6;  // of the grid's places
  const double cell = 1.0 * pattern.width() * pattern.height() / (kGrid * kGrid);
  int count = 0;
  double area = 0.0;
  visit_visible(pattern, map, [&](glm::dvec2 pixel, glm::dvec2) {
    const double scale = scale_at(map, pixel);
    area += cell * scale * scale;
    ++count;
  });
  return count >= kMinPlaces && area > kMinArea;
}

std::array<glm::dvec2, 4> claimed_place(const TrackedPattern& pattern, const PlaneMap& map,
                                        const std::array<glm::dvec2, 4>& corners) {
  if (map.surface == nullptr) return corners;
  glm::dvec2 low(1e9);
  glm::dvec2 high(-1e9);
  visit_visible(pattern, map, [&](glm::dvec2, glm::dvec2 at) {
    low = glm::min(low, at);
    high = glm::max(high, at);
  });
  return {low, {high.x, low.y}, high, {low.x, high.y}};
}

bool same_place(const std::array<glm::dvec2, 4>& a, const std::array<glm::dvec2, 4>& b) {
  const auto contains_centre = [](const std::array<glm::dvec2, 4>& outline,
                                  const std::array<glm::dvec2, 4>& other) {
    const glm::dvec2 centre = 0.25 * (other[0] + other[1] + other[2] + other[3]);
    for (std::size_t i = 0; i < 4; ++i) {
      const glm::dvec2 from = outline[i];
      const glm::dvec2 side = outline[(i + 1) % 4] - from;
      if (side.x * (centre.y - from.y) - side.y * (centre.x - from.x) < 0.0) return false;
    }
    return true;
  };
  const double ratio = area_of(a) / area_of(b);
  return ratio > 0.5 && ratio < 2.0 && contains_centre(a, b) && contains_centre(b, a);
}

// The second solution of the planar pose problem: the plane reflected about the line of sight to
// the pattern's centre.
Pose mirrored(const Pose& pose) {
  const glm::dvec3 sight = glm::normalize(pose.translation);
  const glm::dvec3 normal = pose.rotation[2];
  const glm::dvec3 axis = glm::cross(normal, sight);
  const double sine_2 = glm::dot(axis, axis);
  if (sine_2 < 1e-18) return pose;
  // The normal points towards the camera: turn it through the line of sight to the other side, by
  // twice the angle between them. Rodrigues' formula, from that angle's sine and cosine.
  const double cosine = -glm::dot(normal, sight);
  const glm::dvec3 x = -2.0 * cosine * axis;
  const glm::dmat3 across(0, x.z, -x.y, -x.z, 0, x.x, x.y, -x.x, 0);
  const double cosine_2 = cosine * cosine;
  const double length_2 = cosine_2 + sine_2;
  const glm::dmat3 turn =
      ((cosine_2 - sine_2) * glm::dmat3(1.0) + across + 2.0 * glm::outerProduct(axis, axis)) /
      length_2;
  Pose other = pose;
  other.rotation = turn * pose.rotation;
  return other;
}

std::optional<Pose> nearest_pose(const TrackedPattern& pattern, const Camera& camera,
                                 const PlaneMap& map) {
  const auto pose =
      pose_from_homography(camera, map.homography * glm::inverse(pattern.world_from_pixels()));
  return pose ? std::optional(*pose) : std::nullopt;
}

std::optional<PlaneSplit> split_map(const TrackedPattern& pattern, const Camera& camera,
                                    const PlaneMap& map, double aspect) {
  constexpr double kMost = 0.25;
  glm::dmat3 k(1.0);
  k[0][0] = camera.fx;
  k[1][1] = camera.fy;
  k[2] = {camera.cx, camera.cy, 1.0};
  // Of the picture at its aspect: what remains is near a rotation.
  glm::dmat3 picture = pattern.world_from_pixels();
  glm::dmat3 unshaped(glm::inverse(pattern.shape));
  unshaped[2][2] = 1.0;
  picture = unshaped * picture;
  glm::dmat3 m = glm::inverse(k) * map.homography * glm::inverse(picture);
  m[1] /= aspect;
  if (m[2].z < 0.0) m *= -1.0;
  const double xx = glm::dot(m[0], m[0]);
  const double xy = glm::dot(m[0], m[1]);
  const double yy = glm::dot(m[1], m[1]);
  const double area = std::sqrt(std::max(0.0, xx * yy - xy * xy));
  const double trace = std::sqrt(xx + yy + 2.0 * area);
  if (!(area > 0.0) || !std::isfinite(trace)) return std::nullopt;
  // The square root of a symmetric 2 x 2 matrix, scaled to the area 1.
  const double root = std::sqrt(area);
  const glm::dmat2 stretch = glm::dmat2(xx + area, xy, xy, yy + area) / (trace * root);
  if (!(std::abs(stretch[0][0] - 1.0) < kMost && std::abs(stretch[1][1] - 1.0) < kMost &&
        std::abs(stretch[0][1]) < kMost)) {
    return std::nullopt;
  }
  const glm::dmat2 back = glm::inverse(stretch);
  PlaneSplit split;
  split.pose.rotation[0] = (m[0] * back[0][0] + m[1] * back[0][1]) / root;
  split.pose.rotation[1] = (m[0] * back[1][0] + m[1] * back[1][1]) / root;
  split.pose.rotation[2] = glm::cross(split.pose.rotation[0], split.pose.rotation[1]);
  split.pose.translation = m[2] / root;
  split.shape = stretch * glm::dmat2(1.0, 0.0, 0.0, aspect);
  if (!(split.pose.translation.z > 0.0)) return std::nullopt;
  return split;
}

int fit_poses(const TrackedPattern& pattern, const Camera& camera, const glm::dmat3& homography,
              const PlanePoints& points, std::array<Pose, 2>& poses) {
  const auto start = nearest_pose(pattern, camera, {homography, nullptr});
  if (!start) return 0;
  const Pose first = refine_pose(camera, points.world, points.ideal, *start);
  int count = 0;
  for (const Pose& pose :
       {first, refine_pose(camera, points.world, points.ideal, mirrored(first))}) {
    // The plane's front must face the camera.
    if (glm::dot(pose.rotation[2], pose.translation) < 0.0) {
      poses[static_cast<std::size_t>(count++)] = pose;
    }
  }
  return count;
}

glm::dmat3 orthonormal(const glm::dmat3& rotation) {
  glm::dmat3 out;
  out[0] = glm::normalize(rotation[0]);
  out[1] = glm::normalize(rotation[1] - out[0] * glm::dot(out[0], rotation[1]));
  out[2] = glm::cross(out[0], out[1]);
  return out;
}

Pose extrapolate(const Pose& previous, const Pose& now) {
  const glm::dmat3 turn = now.rotation * glm::transpose(previous.rotation);
  Pose next;
  next.rotation = orthonormal(turn * now.rotation);
  next.translation = now.translation + (now.translation - previous.translation);
  if (!(next.translation.z > 0.0)) return now;
  return next;
}

bool in_view(const TrackedPattern& pattern, const PlaneMap& map, const Camera& camera) {
  constexpr int kGridSide = 5;
  constexpr int kMinInside = 4;  // of 25: names the reason of a loss only
  int inside = 0;
  for (int i = 0; i < kGridSide * kGridSide; ++i) {
    bool in_front = false;
    const glm::dvec2 p =
        map.at({(i % kGridSide + 0.5) / kGridSide * pattern.width(),
                (static_cast<int>(i / kGridSide) + 0.5) / kGridSide * pattern.height()},
               in_front);
    inside += in_front && p.x >= 0 && p.y >= 0 && p.x < camera.width && p.y < camera.height ? 1 : 0;
  }
  return inside >= kMinInside;
}

double corner_distance(const std::array<glm::dvec2, 4>& a, const std::array<glm::dvec2, 4>& b) {
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) most = std::max(most, glm::length(a[i] - b[i]));
  return most;
}

}  // namespace modar::tracker

namespace modar {

void solve_symmetric(int n, int columns, const double* a, double* x) {
  // a = l * diag(d) * transposed l, l with ones on its diagonal; ld = l * diag(d).
  double l[8][8];
  double ld[8][8];
  double inverse[8];  // of d; 0 where the unknown is not determined, which is then 0
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = a[j * n + i];
      for (int k = 0; k < j; ++k) sum -= ld[i][k] * l[j][k];
      ld[i][j] = sum;
      l[i][j] = j < i ? sum * inverse[j] : 1.0;
    }
    const double d = ld[i][i];
    // NaN where d is infinite, as where it is NaN.
    inverse[i] = std::abs(d) <= std::numeric_limits<double>::min() ? 0.0 : 1.0 / d + 0.0 * d;
  }
  for (double* column = x; column != x + columns * n; column += n) {
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < i; ++k) column[i] -= l[i][k] * column[k];
    }
    for (int i = n - 1; i >= 0; --i) {
      column[i] *= inverse[i];
      for (int k = i + 1; k < n; ++k) column[i] -= l[k][i] * column[k];
    }
  }
}

}  // namespace modar
