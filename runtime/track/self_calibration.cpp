// From tracked planes to the camera, and back.
#include "self_calibration.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "patch_alignment.hpp"
#include "plane_geometry.hpp"
#include "pose_refinement.hpp"

namespace modar::tracker {
namespace {

// Frames between measurements of a plane for the camera's estimate. Fewer know the camera sooner
// and take half the time of tracking.
constexpr int kMeasureEvery = 5;
// The same if the last measurement moved a corner noticeably.
constexpr int kMeasureSoon = 2;
// Pixels that count as such a move. With a wrong focal length, the shape lags behind a rotation.
constexpr double kMovedShape = 0.4;
// Patches that must fit for a plane to count as flat.
constexpr int kFlatPatches = 24;
// Share of the patches in view that must fit for a plane to count as open.
constexpr double kFlatRatio = 0.6;
// Iterations of a free homography that starts at the pose, and the weight of a new measurement in
// the shape: a smaller one lags, a larger one jitters.
constexpr int kMeasuringSteps = 2;
constexpr double kNewShape = 0.7;
// Max. rms residual (template px) for a mostly hidden pattern to count as planar. Lower rejects
// defocused true finds; higher accepts false ones. [0.35, 0.55] tuned: pose
constexpr double kMaxPlaneResidual = 0.55;
// Relative change of the focal length after which the learned surroundings are discarded.
constexpr double kLearnedAnew = 0.01;

bool shows_flat(const PatchFit& fit) {
  return fit.inliers >= kFlatPatches && (fit.open() || fit.covered());
}

/// Four points of a pattern, the corners of the part of it that is in the frame, with their pixels;
/// false if that part is too small.
bool places_in_view(const TrackedPattern& pattern, const PlaneMap& map, const Camera& camera,
                    CameraEstimator::View& view) {
  constexpr double kMinExtent = 0.4;  // of each side
  constexpr double kStep = 0.1;
  const double longest = std::max(pattern.width(), pattern.height());
  glm::dvec2 low{0.05, 0.05};  // shares of width and height
  glm::dvec2 high{0.95, 0.95};
  for (;;) {
    const std::array<glm::dvec2, 4> shares = {low, glm::dvec2{high.x, low.y}, high,
                                              glm::dvec2{low.x, high.y}};
    std::array<bool, 4> inside{};
    for (std::size_t i = 0; i < 4; ++i) {
      const glm::dvec2 pixel{shares[i].x * pattern.width() - 0.5,
                             shares[i].y * pattern.height() - 0.5};
      const glm::dvec2 seen = map.at(pixel, inside[i]);
      inside[i] = inside[i] && seen.x >= 0 && seen.y >= 0 && seen.x < camera.width &&
                  seen.y < camera.height;
      view.world[i] = {(2.0 * shares[i].x - 1.0) * pattern.width() / longest,
                       (1.0 - 2.0 * shares[i].y) * pattern.height() / longest};
      view.pixels[i] = undistort(camera, seen);
    }
    // The side whose places are out goes inwards; of a single corner, both of its sides.
    const bool left = !(inside[0] && inside[3]);
    const bool right = !(inside[1] && inside[2]);
    const bool top = !(inside[0] && inside[1]);
    const bool bottom = !(inside[2] && inside[3]);
    if (!left && !right) return true;
    if (left != right) (left ? low.x : high.x) += left ? kStep : -kStep;
    if (top != bottom) (top ? low.y : high.y) += top ? kStep : -kStep;
    if (left == right && top == bottom) {
      low += kStep;
      high -= kStep;
    }
    if (high.x - low.x < kMinExtent || high.y - low.y < kMinExtent) return false;
  }
}

}  // namespace

/// Measures a tracked flat pattern's free homography: what it says of the camera_, and what a pose
/// leaves of it, since no camera explains the pictures of a stabilised or distorting one.
bool SelfCalibration::measure(std::size_t i, Detection& detection) {
  Track& track = tracks_[i];
  if (!patterns_[i].surface.flat() || track.doubts > 0) return true;
  if (--track.frames_to_measure > 0 && track.measured) return true;
  track.frames_to_measure = kMeasureEvery;
  CameraEstimator::View view{i, {}, {}, track.pose};
  bool open = detection.inliers >= kFlatRatio * detection.matches;
  bool inconsistent = false;
  if (!(track.measured ? measure_again(i, view) : measure_first(i, view, open, inconsistent)))
    return !inconsistent;
  if (open && estimator_.is_new(i, view.pixels)) estimator_.add(view);
  const std::array<glm::dvec2, 4> before = detection.corners;
  frames_.locate(patterns_[i], track, detection);
  if (!track.measured || corner_distance(before, detection.corners) > kMovedShape)
    track.frames_to_measure = kMeasureSoon;
  track.measured = true;
  track.homography_only = false;
  return true;
}

/// Goes to a pattern's plane at a pose; false if the camera could not see it there, or sees too
/// little of it.
bool SelfCalibration::view_plane(const TrackedPattern& plane, const Pose& pose,
                                 CameraEstimator::View& view, PlaneSplit& split) const {
  const PlaneMap map = map_of_pose(plane, camera_, pose);
  const auto known = split_map(plane, camera_, map, estimator_.aspect(view.pattern));
  if (!known || !places_in_view(plane, map, camera_, view)) return false;
  split = *known;
  view.pose = split.pose;
  return true;
}

/// From where a pose, or a map, was found.
/// open: whether nothing covers it; corners beyond what does would say more of the camera than they
/// know.
bool SelfCalibration::measure_first(std::size_t i, CameraEstimator::View& view, bool& open,
                                    bool& inconsistent) {
  Track& track = tracks_[i];
  TrackedPattern plane = patterns_[i];
  Pose pose = track.pose;
  PlaneSplit split;
  if (track.homography_only) {
    const auto known = split_map(plane, camera_, track.map, estimator_.aspect(i));
    if (!known) return false;
    plane.shape = known->shape;
    pose = known->pose;
  }
  PatchFit fit;
  const bool fits = refine_plane(plane, frames_.frame(), pose, fit);
  inconsistent = fit.residual_rms >= kMaxPlaneResidual;
  if (!fits || inconsistent || !shows_flat(fit) || !view_plane(plane, pose, view, split))
    return false;
  track.pose = split.pose;
  patterns_[i].shape = split.shape;
  open = fit.open();
  return true;
}

/// From where tracking has it.
bool SelfCalibration::measure_again(std::size_t i, CameraEstimator::View& view) {
  Track& track = tracks_[i];
  TrackedPattern plane = patterns_[i];
  Pose pose = track.pose;
  PlaneChange change;
  PlaneSplit split;
  const auto frame = frames_.frame();
  const PlaneMap map = map_of_pose(plane, camera_, pose);
  const int level = finest(plane, map, static_cast<int>(frame.pyramid.size())).frame_level;
  if (!places_in_view(plane, map, camera_, view) ||
      !shows_flat(align_plane(plane, frame, level, kMeasuringSteps, kMaxPatches, pose, change)) ||
      !view_plane(plane, pose, view, split)) {
    return false;
  }
  // Tracking weighs patches otherwise: it continues from its own pose, moved by the shape, and
  // its motion from where that shape would have had the pattern a frame before.
  const Pose moved = change.pose_after(track.pose, kNewShape);
  const glm::dmat3 undo = glm::transpose(track.pose.rotation);
  track.previous.translation +=
      track.previous.rotation * (undo * (moved.translation - track.pose.translation));
  track.previous.rotation = track.previous.rotation * undo * moved.rotation;
  track.pose = moved;
  patterns_[i].shape = change.shape_after(patterns_[i].shape, kNewShape);
  return true;
}

bool SelfCalibration::apply() {
  const double focal = estimator_.estimate().focal;
  const Camera before = camera_;
  camera_.fx = camera_.fy = focal;
  for (std::size_t i = 0; i < patterns_.size(); ++i) {
    TrackedPattern& pattern = patterns_[i];
    if (!pattern.surface.flat()) continue;
    const glm::dmat2 alone(1.0, 0.0, 0.0, estimator_.aspect(i));
    Track& track = tracks_[i];
    const auto plane =
        split_map(pattern, camera_, map_of_pose(pattern, before, track.pose), alone[1][1]);
    if (!track.tracked || track.homography_only || !plane) {
      forget_plane(i);
      track.measured = false;
      continue;
    }
    if (track.has_motion) {
      const auto previous =
          split_map(pattern, camera_, map_of_pose(pattern, before, track.previous), alone[1][1]);
      track.has_motion = previous.has_value();
      if (previous) track.previous = previous->pose;
    }
    track.pose = plane->pose;
    pattern.shape = plane->shape;
  }
  const bool moved = std::abs(focal - learned_focal_) > kLearnedAnew * learned_focal_;
  if (moved) learned_focal_ = focal;
  return moved;
}

void SelfCalibration::place_pictures(TrackResult& result) const {
  for (Detection& seen : result.visible) {
    const auto which = std::find_if(
        patterns_.begin(), patterns_.end(),
        [&](const TrackedPattern& one) { return one.shown_by(seen.pattern, seen.copy); });
    if (which == patterns_.end() || !which->surface.flat()) continue;
    const auto i = static_cast<std::size_t>(which - patterns_.begin());
    const DrawnPose drawn = drawn_pose(*which, camera_, seen.pose, estimator_.aspect(i));
    seen.pose = drawn.pose;
    seen.stretch = drawn.stretch;
  }
}

}  // namespace modar::tracker
