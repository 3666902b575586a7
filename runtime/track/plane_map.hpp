// From a pattern's pixels to the frame's: a homography and, where the lens bends, its distortion.
// Internal to runtime/track.
#pragma once

#include <array>
#include <optional>
#include <span>

#include <glm/mat2x2.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>

#include "modar/camera.hpp"
#include "modar/pose.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// Features that agree with a place: on the pattern's plane, in the frame, and the pixels that the
/// frame's place is good to.
struct PlanePoints {
  std::span<const glm::dvec2> world;
  std::span<const glm::dvec2> ideal;
  std::span<const double> sigma;
};

/// homography: pattern pixels to ideal pixels (of a pinhole without distortion).
struct PlaneMap {
  glm::dmat3 homography{1.0};
  const Camera* lens = nullptr;  ///< null where it does not bend

  /// Frame pixel of a pattern pixel; `ahead` is false where the point lies behind the camera.
  [[nodiscard]] glm::dvec2 at(glm::dvec2 pixel, bool& ahead) const;
  /// Its derivative by the pattern pixel (columns), the lens taken as straight.
  [[nodiscard]] glm::dmat2 derivative(glm::dvec2 pixel) const;
};

/// `camera` where its lens bends, else null.
const Camera* bending(const Camera& camera);

PlaneMap map_of_pose(const TrackedPattern& pattern, const Camera& camera, const Pose& pose);

/// Corners in the order of Detection; false where one lies behind the camera.
bool map_corners(const TrackedPattern& pattern, const PlaneMap& map,
                 std::array<glm::dvec2, 4>& corners);

/// False where no camera before the plane's face sees the pattern so: mirrored, bent over itself,
/// or smaller than a thumbnail.
bool plausible(const std::array<glm::dvec2, 4>& corners);

/// Whether two outlines mean one thing of the scene: each holds the other's middle, and neither is
/// twice as large. A card on a poster is another thing. Both: plausible().
bool same_place(const std::array<glm::dvec2, 4>& a, const std::array<glm::dvec2, 4>& b);

/// Poses that explain the points: from the homography, refined over all points, and its mirror
/// image about the line of sight, which from few points looks much the same (Collins & Bartoli,
/// "Infinitesimal plane-based pose estimation", 2014, discuss the two). Those whose face looks away
/// are left out. Answers how many.
int fit_poses(const TrackedPattern& pattern, const Camera& camera, const glm::dmat3& homography,
              const PlanePoints& points, std::array<Pose, 2>& poses);

/// The camera's pose that comes nearest to a map; none where the plane lies not before the camera.
std::optional<Pose> nearest_pose(const TrackedPattern& pattern, const Camera& camera,
                                 const PlaneMap& map);

}  // namespace modar::tracker
