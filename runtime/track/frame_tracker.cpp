// Predict, align; under blur, align blurred templates; if that fails, look further away.
#include "frame_tracker.hpp"

#include <algorithm>

#include <glm/geometric.hpp>

namespace modar::tracker {
namespace {

// Share of the recent inlier ratio below which other starts are tried. Higher takes time under
// every passing hand. [0.375, 0.9] tuned: wild
constexpr double kSuspicious = 0.75;
// Share of a coarser level's inlier ratio at which a sharp fit on a finer one stays. Higher lets
// occluders pull the pose away. [0, 1]
constexpr double kSharpShare = 0.6;
// Share of the recent inlier ratio below which the pose is not shown. Lower shows poses displaced
// by blur, higher hides covered patterns.
constexpr double kDoubtful = 0.5;
// Doubtful frames in a row after which the track is lost and a search decides.
constexpr int kMaxDoubts = 3;
// Pixels of the last prediction's error up to which refinement starts on the finest levels. Smaller
// takes time, larger loses the start more often.
constexpr double kNearError = 1.0;
// The same for the start one level above.
constexpr double kCloseError = 2.5;
// Way of the pattern's centre between frames, pixels: less blurs too little to matter, and what
// moves further is rarely found by the first alignment.
constexpr double kMinBlurringWay = 4.0;
constexpr double kMaxBlurringWay = 80.0;
// Blurred templates must raise the mean correlation by so much to be used: below it is noise.
constexpr double kMinBlurGain = 0.02;
// Share of a sharp frame's correlation below which blur is suspected. Lower misses blur, higher
// takes time. [0.9, 0.98] tuned: pose
constexpr double kBlurred = 0.96;
// Factor per frame by which the sharp frames' correlation fades. Lower forgets sharp frames sooner
// after a change of light.
constexpr double kFading = 0.99;

}  // namespace

[[gnu::cold]] FrameTracker::FrameTracker(const Camera& camera, const DetectOptions& options)
    : camera_(camera),
      kernels_(kernels(options.simd)),
      extractor_(FeatureExtractor::create(camera.width, camera.height, options)) {}

bool FrameTracker::locate(const TrackedPattern& pattern, const Track& track,
                          Detection& detection) const {
  detection.pattern = pattern.index;
  detection.copy = pattern.copy;
  detection.pose = track.pose;
  const PlaneMap map =
      track.homography_only ? track.map : map_of_pose(pattern, camera_, track.pose);
  return locate_corners(pattern, map, detection.corners);
}

std::array<glm::dvec2, 4> FrameTracker::place(const TrackedPattern& pattern, const Track& track,
                                              const Detection& detection) const {
  if (pattern.surface.flat()) return detection.corners;
  return claimed_place(pattern, map_of_pose(pattern, camera_, track.pose), detection.corners);
}

double FrameTracker::distance(const TrackedPattern& pattern, const Pose& a, const Pose& b) const {
  const auto centre = [&](const Pose& at) {
    bool in_front = false;
    return map_of_pose(pattern, camera_, at)
        .anywhere({0.5 * pattern.width(), 0.5 * pattern.height()}, in_front);
  };
  return glm::length(centre(a) - centre(b));
}

/// Refines the predicted pose, from no further away than the last prediction missed; where that
/// does not fit as before, or nothing is known of before, from further away, too. On coarse levels
/// an occluder pulls the pose away, and chance adds inliers: they do not stand
/// against what fits sharply on finer ones.
bool FrameTracker::refine_predicted(const TrackedPattern& pattern, const Track& track, Pose& pose,
                                    PatchFit& fit) const {
  Pose near = pose;
  PatchFit near_fit;
  bool near_found = false;
  if (!track.has_motion || track.prediction_error < kCloseError) {
    const bool close = track.has_motion && track.prediction_error >= kNearError;
    near_found = refine(pattern, frame(), close ? SearchRadius::kClose : SearchRadius::kNear, near,
                        near_fit);
    if (near_found && track.has_motion &&
        near_fit.inlier_ratio() >= kSuspicious * track.inlier_ratio &&
        near_fit.correlation >= kBlurred * track.correlation) {
      pose = near;
      fit = near_fit;
      return true;
    }
  }
  const bool found = refine(pattern, frame(), SearchRadius::kFrame, pose, fit);
  const double least = fit.level > near_fit.level ? kSharpShare : 1.0;
  const bool covered =
      near_found && near_fit.covered() && near_fit.inlier_ratio() >= least * fit.inlier_ratio();
  if (!covered) return found;
  pose = near;
  fit = near_fit;
  return true;
}

/// From further away: the predicted pose, then the last one, whichever shows more of the pattern.
bool FrameTracker::reacquire(const TrackedPattern& pattern, const Track& track,
                             const Pose& predicted, Pose& pose, PatchFit& fit) const {
  bool found = fit.inliers > 0;
  int best = found ? photometric_percent(pattern, frame(), pose) : kMinPercent - 1;
  for (int attempt = 0; attempt < (track.has_motion ? 2 : 1); ++attempt) {
    Pose tried = attempt == 0 ? predicted : track.pose;
    PatchFit now;
    if (!refine(pattern, frame(), SearchRadius::kFar, tried, now)) continue;
    const int percent = photometric_percent(pattern, frame(), tried);
    if (percent <= best) continue;
    best = percent;
    pose = tried;
    fit = now;
    found = true;
    if (fit.inlier_ratio() >= kSuspicious * track.inlier_ratio) break;
  }
  return found;
}

/// If a moving pattern is seen less clearly than before: estimates the exposure, and aligns
/// templates blurred alike. Returns whether these fit better.
bool FrameTracker::refine_blurred(const TrackedPattern& pattern, const Track& track,
                                  const Pose& predicted, Pose& pose, PatchFit& fit) {
  const double way = distance(pattern, pose, track.pose);
  if (!track.has_motion || !(fit.inliers > 0) || way < kMinBlurringWay || way > kMaxBlurringWay) {
    return false;
  }
  if (exposure_ == 0.0 && fit.correlation > kBlurred * track.correlation) return false;
  MotionBlur blur{track.pose, 0.0};
  FrameView blurred = frame();
  blurred.blur = &blur;
  // One level above the finest, where an error of a few pixels matters little.
  const int levels = static_cast<int>(blurred.pyramid.size());
  const int level = finest(pattern, map_of_pose(pattern, camera_, pose), levels).frame_level + 1;
  if (level >= levels) return false;
  exposure_ = 0.0;
  double best = evaluate(pattern, frame(), level, pose).correlation + kMinBlurGain;
  for (int quarter = 1; quarter <= 4; ++quarter) {
    blur.share = 0.25 * quarter;
    const double now = evaluate(pattern, blurred, level, pose).correlation;
    if (now <= best) continue;
    best = now;
    exposure_ = blur.share;
  }
  blur.share = exposure_;
  if (exposure_ == 0.0) return false;
  Pose tried = predicted;
  PatchFit now;
  if (!refine(pattern, blurred, SearchRadius::kFrame, tried, now) ||
      now.correlation <= fit.correlation) {
    return false;
  }
  pose = tried;
  fit = now;
  return true;
}

bool FrameTracker::update_pose(const TrackedPattern& pattern, Track& track, PatchFit& fit) {
  const Pose predicted = track.has_motion ? extrapolate(track.previous, track.pose) : track.pose;
  Pose pose = predicted;
  bool found = refine_predicted(pattern, track, pose, fit);
  const bool blurred = refine_blurred(pattern, track, predicted, pose, fit);
  found = found || blurred;
  if (!blurred && fit.correlation > track.correlation) track.correlation = fit.correlation;
  track.correlation *= kFading;
  // Nothing is known of the frames before a find: covered parts there are not suspected.
  const bool suspicious =
      (track.has_motion || !fit.covered()) && fit.inlier_ratio() < kSuspicious * track.inlier_ratio;
  if (!found || (!blurred && suspicious)) {
    const PatchFit seen = fit;
    if (!found) fit = {};
    found = reacquire(pattern, track, predicted, pose, fit);
    if (!found) fit = seen;
  }
  if (!found) return false;
  const double ratio = fit.inlier_ratio();
  if (!track.has_motion) track.inlier_ratio = ratio;
  track.doubts = ratio < kDoubtful * track.inlier_ratio ? track.doubts + 1 : 0;
  if (track.doubts > kMaxDoubts) return false;
  track.inconsistent = fit.inconsistent() ? track.inconsistent + 1 : 0;
  if (track.doubts == 0) track.inlier_ratio = 0.8 * track.inlier_ratio + 0.2 * ratio;
  track.prediction_error = distance(pattern, predicted, pose);
  track.previous = track.pose;
  track.pose = pose;
  track.has_motion = true;
  return true;
}

bool FrameTracker::update(const TrackedPattern& pattern, Track& track, Detection& detection) {
  const Track last = track;
  PatchFit fit;
  bool found = false;
  if (track.homography_only) {
    found = refine_map(pattern, frame(), track.map, fit);
    const auto pose = nearest_pose(pattern, camera_, track.map);
    found = found && pose.has_value();
    if (found) track.pose = *pose;
  } else {
    found = update_pose(pattern, track, fit);
  }
  if (found && locate(pattern, track, detection)) {
    detection.matches = fit.visible;
    detection.inliers = fit.inliers;
    return true;
  }
  track = last;
  track.has_motion = false;
  const Pose expected = last.has_motion ? extrapolate(last.previous, last.pose) : last.pose;
  const PlaneMap map = last.homography_only ? last.map : map_of_pose(pattern, camera_, expected);
  track.last_reason = in_view(pattern, map, camera_) ? Reason::kLostByBlur : Reason::kOutOfView;
  track.place = {};
  std::array<glm::dvec2, 4> corners;
  if (!map_corners(pattern, map, corners)) return false;
  track.place = seen_at(corners);
  if (last.has_motion && map_corners(pattern, map_of_pose(pattern, camera_, last.pose), corners)) {
    track.place.step = track.place.corner - corners[0];
  } else if (last.place.votes == LikelyPlace::kSeen) {
    // It was lost in the frame before, and found next to where it was expected.
    track.place.step = last.place.step + track.place.corner - last.place.corner;
    track.place.corner += track.place.step;
  }
  return false;
}

}  // namespace modar::tracker
