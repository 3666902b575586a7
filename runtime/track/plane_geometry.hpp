// The plane of a pattern in a frame: maps between pattern pixels and frame pixels, poses that
// explain points of the plane, the motion model, and the small solvers behind them. Internal to
// runtime/track.
#pragma once

#include <array>
#include <optional>
#include <span>

#include <glm/mat2x2.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>

#include "modar/camera.hpp"
#include "modar/image.hpp"
#include "modar/pose.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// The power of two that is nearest to a positive scale, exactly: a libm's log2 may round to
/// another.
int nearest_octave(double scale);

inline glm::dvec3 vector_of(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

/// Point correspondences of a pattern: on its plane (ModAR Eq. 1) or surface, and in the frame.
struct PlanePoints {
  std::span<const glm::dvec3> world;
  std::span<const glm::dvec2> ideal;  ///< undistorted frame pixels
  std::span<const double> sigma;      ///< standard deviation of `ideal`, pixels
};

/// Pattern pixels to frame pixels: a homography, then the lens distortion. Of a curved pattern, a
/// point of its surface takes the homography's place: each pixel has the map of its tangent plane.
struct PlaneMap {
  glm::dmat3 homography{1.0};               ///< to the pixels of a pinhole without distortion
  const Camera* lens = nullptr;             ///< null: no distortion
  const PatternSurface* surface = nullptr;  ///< null: flat; else `homography` takes its points, and
  glm::dvec3 shift{};                       ///< this is added
  glm::dvec3 eye{};                         ///< the camera, pattern axes

  /// Frame pixel of a pattern pixel; `in_front` is false where the point is behind the camera, or
  /// where a curved pattern turns away from it. mean_square: of the distances around the pixel; a
  /// curved pattern bends away by half of it, as the best plane through them does.
  [[nodiscard]] glm::dvec2 at(glm::dvec2 pixel, bool& in_front, double mean_square = 0) const;
  /// The same of places that are turned away, too.
  [[nodiscard]] glm::dvec2 anywhere(glm::dvec2 pixel, bool& in_front) const;
  /// Jacobian by the pattern pixel (columns). Ignores the distortion, which is nearly constant over
  /// a patch.
  [[nodiscard]] glm::dmat2 derivative(glm::dvec2 pixel) const;
};

/// The camera if its lens distorts, otherwise null.
const Camera* distorting_lens(const Camera& camera);

PlaneMap map_of_pose(const TrackedPattern& pattern, const Camera& camera, const Pose& pose);

/// Frame pixels of a pattern's pixel, in the middle of what shows.
double scale_of(const TrackedPattern& pattern, const PlaneMap& map);

/// The pattern's corners in the order of Detection; false if one is behind the camera.
bool map_corners(const TrackedPattern& pattern, const PlaneMap& map,
                 std::array<glm::dvec2, 4>& corners);

/// False if no camera in front of the plane can see this outline: mirrored, not convex, or smaller
/// than 300 square pixels.
bool plausible(const std::array<glm::dvec2, 4>& corners);

/// Finds the corners; false if no camera can see the pattern like that: flat ones are plausible(),
/// of others enough is turned towards the camera.
bool locate_corners(const TrackedPattern& pattern, const PlaneMap& map,
                    std::array<glm::dvec2, 4>& corners);
/// The place that a pattern takes in the frame: its outline, of curved ones a box around what
/// shows.
std::array<glm::dvec2, 4> claimed_place(const TrackedPattern& pattern, const PlaneMap& map,
                                        const std::array<glm::dvec2, 4>& corners);

/// Whether two plausible outlines claim the same object: each contains the other's centre, and
/// their areas differ by less than a factor of two. A card on top of a poster is another object.
bool same_place(const std::array<glm::dvec2, 4>& a, const std::array<glm::dvec2, 4>& b);

/// Poses that explain the points: the homography's, refined over all points, and its mirror image
/// about the line of sight, which few points cannot tell from it (Collins & Bartoli, "Infinitesimal
/// plane-based pose estimation", 2014, discuss the two). Poses that see the pattern's back are left
/// out. Returns how many.
int fit_poses(const TrackedPattern& pattern, const Camera& camera, const glm::dmat3& homography,
              const PlanePoints& points, std::array<Pose, 2>& poses);

/// The other pose that few points of a plane do not tell from this one.
Pose mirrored(const Pose& pose);

/// The camera pose closest to a map; none if the plane is not in front of the camera.
std::optional<Pose> nearest_pose(const TrackedPattern& pattern, const Camera& camera,
                                 const PlaneMap& map);

/// A map of a flat pattern as a pose and the pattern's plane relative to its picture
/// (TrackedPattern::shape): exactly the map, by the rotation that needs the least of a shape (polar
/// decomposition). aspect: the area that the shape gives the picture. None if no camera could see
/// it, or the shape would be off by more than a quarter.
struct PlaneSplit {
  Pose pose;
  glm::dmat2 shape{1.0};
};
std::optional<PlaneSplit> split_map(const TrackedPattern& pattern, const Camera& camera,
                                    const PlaneMap& map, double aspect);

/// The rotation nearest to a nearly orthonormal matrix: the rounding error of a pose that is
/// fed back every frame doubles each time otherwise.
glm::dmat3 orthonormal(const glm::dmat3& rotation);

/// Constant-velocity prediction: the pose that repeats the motion from `previous` to `now`.
Pose extrapolate(const Pose& previous, const Pose& now);

/// Whether at least 4 of 5x5 points of the pattern project into the frame.
bool in_view(const TrackedPattern& pattern, const PlaneMap& map, const Camera& camera);

/// Bilinear gray value; the caller guarantees 0 <= x < width - 1 and 0 <= y < height - 1.
inline float sample(const GrayImage& image, float x, float y) {
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const std::uint8_t* p = image.pixels + row * image.stride + column;
  const float a = p[0];
  const float b = p[1];
  const float c = p[image.stride];
  const float d = p[image.stride + 1];
  const float top = a + fx * (b - a);
  const float bottom = c + fx * (d - c);
  return top + fy * (bottom - top);
}

/// Largest distance between corresponding corners, pixels.
double corner_distance(const std::array<glm::dvec2, 4>& a, const std::array<glm::dvec2, 4>& b);

}  // namespace modar::tracker

namespace modar {

/// Solves A X = B by L D L^T without pivots for any size up to 8. Eigen's, which has them, takes
/// 42,000 instructions more in a tracked frame (`scripts/foreign.sh budget`) and 4 KB of the
/// device's player. a: n x n, column-major, of which the lower triangle is read. x: `columns`
/// right-hand sides of n numbers each, replaced by their solutions. Unobservable unknowns come out
/// as 0; non-finite input gives non-finite output.
void solve_symmetric(int n, int columns, const double* a, double* x);

/// The same for column-major fixed-size matrices such as Eigen's; returns the solutions.
template <class Matrix, class Right>
Right solve_symmetric(const Matrix& a, Right x) {
  solve_symmetric(static_cast<int>(x.rows()), static_cast<int>(x.cols()), a.data(), x.data());
  return x;
}

}  // namespace modar
