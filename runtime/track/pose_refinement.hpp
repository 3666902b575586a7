// From an approximate pose to the one in the frame: refinement over pyramid levels, refinement from
// the features of a part of the pattern, and the photometric check of the result. Internal to
// runtime/track.
#pragma once

#include <cstdint>
#include <span>

#include "patch_alignment.hpp"
#include "photometry.hpp"

namespace modar::tracker {

/// Percent of the textured cells in view that a pose must reproduce. Lower accepts chance, higher
/// loses patterns covered to two thirds.
inline constexpr int kMinPercent = 30;
/// The same of a place that kConfirmingFeatures features agree with: half-covered patterns went
/// from 95.0 to 98.8 % right with that and what PatchFit::good() makes of it.
inline constexpr int kConfirmedPercent = 20;
/// Cells that must agree at least. Lower accepts smooth cells that look alike anywhere. [4, 16]
/// tuned: pose
inline constexpr int kMinCells = 8;

/// Percentage of the textured cells in view that correlate; 0 if fewer do than `min_cells`.
int photometric_percent(const TrackedPattern& pattern, const FrameView& frame, const Pose& pose,
                        int min_cells = kMinCells);

/// How far the pose may be off, and so how many levels above the finest refinement starts: 0, 1,
/// 2, 4. Coarse patches reach across the edge of an occluder and cost time, so the smallest
/// sufficient radius is best.
enum class SearchRadius : std::uint8_t { kNear, kClose, kFrame, kFar };

/// Aligns patches from the coarsest level of the radius to the finest. True if the finest level
/// fits, or under blur a coarser one that the photometric check confirms. precise: the finest level
/// ends with steps over all patches.
bool refine(const TrackedPattern& pattern, const FrameView& frame, SearchRadius radius, Pose& pose,
            PatchFit& fit, bool precise = true);

/// The same for a plane map, where a wrong focal length leaves no pose that fits. A map has to
/// pass verification alone: its percentage is 0 below 50 % or 16 cells.
bool refine_map(const TrackedPattern& pattern, const FrameView& frame, PlaneMap& map, PatchFit& fit,
                SearchRadius radius = SearchRadius::kFrame);
int map_photometric_percent(const TrackedPattern& pattern, const FrameView& frame,
                            const PlaneMap& map);

/// Aligns a flat pattern's pose and its shape with it, from where a pose alone has the pattern: a
/// free homography, as refined on one level above the finest. False, and nothing changed, if
/// too little of the pattern fits.
bool refine_plane(TrackedPattern& pattern, const FrameView& frame, Pose& pose, PatchFit& fit);

/// The place of a flat pattern's picture, for drawing on it: the pose whose outline comes nearest
/// to that of `pose` and the pattern's shape, and what that leaves (Detection::stretch). The pose
/// of a split_map() is no such one: it assigns all that the camera does not explain to the plane,
/// so that its own outline was 5 to 9 pixels of 640 off the print's on four real clips, where this
/// one is 1.3 to 3.2 (`modar-lab bench wild`). aspect: of split_map(); what stands upright does so
/// on a print with this aspect.
struct DrawnPose {
  Pose pose;
  glm::dmat4x3 stretch{1.0};
};
DrawnPose drawn_pose(const TrackedPattern& pattern, const Camera& camera, const Pose& pose,
                     double aspect);

/// Root mean square distance of the points from their projections, in their sigmas.
double reprojection_rms(const Camera& camera, const Pose& pose, const PlanePoints& points);

/// Refines a pose by the points, and by those patches whose place the pose predicts to about a
/// pixel. Each patch found there determines its own place better than features do, and so the
/// places of the patches beyond it: a pose spreads from where its features are over all that is
/// visible.
void refine_from_inliers(const TrackedPattern& pattern, const FrameView& frame,
                         const PlanePoints& points, Pose& pose);

/// Frame pixels by which the corners of a bent print, mean of the four, are off those of the plane
/// of its pose: a few steps over the patches that show, with two bulges in addition to the pose's
/// parameters. 0 where it is less than `least`, where few patches show, or where the bulges do not
/// make the frame more alike than a free homography does.
double bend_of(const TrackedPattern& pattern, const FrameView& frame, const Pose& pose,
               double least);

}  // namespace modar::tracker
