// One patch of a pattern against the frame: where it lies, what it says of its displacement.
// Internal to runtime/track.
#pragma once

#include <array>
#include <span>

#include <glm/mat2x2.hpp>
#include <glm/vec2.hpp>

#include "plane_align.hpp"

namespace modar::tracker {

inline constexpr float kHeld = 0.7f;  ///< correlation of a patch that fits

/// What a patch says of its own displacement, in template pixels: g d = e, both by its weight.
struct Pull {
  float xx = 0, xy = 0, yy = 0;
  float ex = 0, ey = 0;
  float correlation = 0;
};

/// The displacement that a pull asks for, in template pixels; nothing where it has no say. A trace
/// of stiffness keeps it short along an edge, of which a patch of one edge knows nothing.
glm::vec2 way_of(const Pull& pull);

/// The patches of the level at hand, and every how many of them is looked at.
struct View {
  const GrayImage* image;
  const Kernels* kernels;
  Resolution at;
  std::span<const Patch> patches;
  std::size_t stride = 1;
  bool settled = false;  ///< the pose is right to a fraction of a pixel
};

/// The view of a level for a map; no patches where the pattern has no image for it. Of every
/// stride, about `few` patches are left.
View view_of(const TrackedPattern& pattern, const Scene& scene, int frame_level,
             const PlaneMap& map, std::size_t few);

/// A patch that lies inside the level.
struct Glance {
  Pull pull;
  glm::dvec2 seen{};   ///< frame pixels of its centre
  glm::dmat2 slope{};  ///< template pixels to pixels of the level
};

/// False where the patch does not lie inside the level. forgiving: 1 minus the correlation at which
/// a patch has no say any more.
bool glance(const View& view, const PlaneMap& map, const Patch& patch, float forgiving,
            Glance& out);

/// Derivative of a world point's pixel by a small turn on the left and a shift.
struct PoseSlope {
  std::array<double, 6> x{};
  std::array<double, 6> y{};
};
PoseSlope pose_slope(const Camera& camera, const Pose& pose, glm::dvec2 world, double scale);
/// Moves the pose by such a turn and shift. Answers by how many pixels the pattern's corners move,
/// at most, times that scale: where only a part of the pattern shows, the rest hangs on it like on
/// a lever. Negative where the pose would lie behind the camera: it stays.
double move(const TrackedPattern& pattern, const Camera& camera, double scale,
            const std::array<double, 6>& change, Pose& pose);

}  // namespace modar::tracker
