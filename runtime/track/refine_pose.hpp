// Brings a pose near a pattern to its place in the frame, and judges it by the picture. Internal to
// runtime/track.
#pragma once

#include <cstdint>
#include <span>

#include "plane_align.hpp"

namespace modar::tracker {

/// Share of the textured cells in view that a pose must show to be believed.
inline constexpr int kRightPercent = 30;
/// And in how many cells at least.
inline constexpr int kRightCells = 8;

/// How far away the pose may be, and so how coarse a level it starts on and how many steps it
/// takes. Coarse patches reach over the edge of whatever hides a part of the pattern: the nearer
/// the better.
enum class Reach : std::uint8_t { kNear, kFrame, kFar };

/// From a coarse level, on which the pattern is still some tens of pixels large, to the finest.
/// Answers true where the finest level holds, or under blur a coarser one that the whole picture
/// confirms.
bool settle(const TrackedPattern& pattern, const Scene& scene, Reach reach, Pose& pose, Fit& fit);

/// Photometric check: percentage of the textured cells in view that look as they should; 0 where
/// fewer do than `fewest_cells`.
int percent_right(const TrackedPattern& pattern, const Scene& scene, const Pose& pose,
                  int fewest_cells = kRightCells);

/// The same two for a plane's own map, where a wrong focal length bends every pose: it must
/// convince by itself, so its percentage is 0 where not much more speaks for it.
bool settle_map(const TrackedPattern& pattern, const Scene& scene, PlaneMap& map, Fit& fit);
int map_percent(const TrackedPattern& pattern, const Scene& scene, const PlaneMap& map);

}  // namespace modar::tracker
