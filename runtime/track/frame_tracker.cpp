// Patches of the frame before lead to those of this one; where they do not, why.
#include "frame_tracker.hpp"

#include <algorithm>

#include <glm/geometric.hpp>

#include "motion.hpp"

namespace modar::tracker {
namespace {

constexpr double kSuspicious = 0.75;  // of the share that the frames before held
constexpr double kBlurringWay = 4.0;  // pixels from frame to frame
constexpr double kFarWay = 80.0;      // the same: what moves so far was not even found
constexpr double kClearer = 0.02;     // likeness that smeared templates must gain
constexpr double kUnclear = 0.96;     // of the likeness before
constexpr double kForgetting = 0.99;  // of that, a frame

}  // namespace

FrameTracker::FrameTracker(const Camera& camera, const DetectOptions& options)
    : camera_(camera),
      kernels_(kernels(options.simd)),
      eye_(FeatureExtractor::create(camera.width, camera.height, options)) {}

bool FrameTracker::report(const TrackedPattern& pattern, const Track& track,
                          Detection& detection) const {
  detection.pattern = pattern.index;
  detection.pose = track.pose;
  const PlaneMap map = track.by_map ? track.map : map_of_pose(pattern, camera_, track.pose);
  return map_corners(pattern, map, detection.corners) && plausible(detection.corners);
}

/// From further away: where the motion says, then where it was, whichever shows more.
bool FrameTracker::find_again(const TrackedPattern& pattern, const Track& track,
                              const Pose& predicted, Pose& pose, Fit& fit) const {
  bool found = fit.held > 0;
  int best = found ? percent_right(pattern, scene(), pose) : kRightPercent - 1;
  for (int attempt = 0; attempt < (track.moving ? 2 : 1); ++attempt) {
    Pose tried = attempt == 0 ? predicted : track.pose;
    Fit now;
    if (!settle(pattern, scene(), Reach::kFar, tried, now)) continue;
    const int right = percent_right(pattern, scene(), tried);
    if (right <= best) continue;
    best = right;
    pose = tried;
    fit = now;
    found = true;
    if (fit.share() >= kSuspicious * track.share) break;
  }
  return found;
}

/// Where a moving pattern is seen less clearly than before: whether it is blurred by that motion,
/// how much, and where it lies with templates that are blurred alike. Answers whether that fits
/// better.
bool FrameTracker::unsmear(const TrackedPattern& pattern, const Track& track, const Pose& predicted,
                           Pose& pose, Fit& fit) {
  const auto corner = [&](const Pose& at) {
    bool ahead = false;
    return map_of_pose(pattern, camera_, at)
        .at({0.5 * pattern.width(), 0.5 * pattern.height()}, ahead);
  };
  const double way = glm::length(corner(pose) - corner(track.pose));
  if (!track.moving || !(fit.held > 0) || way < kBlurringWay || way > kFarWay) return false;
  if (smear_ == 0.0 && fit.likeness > kUnclear * track.likeness) return false;
  Smear how{track.pose, 0.0};
  Scene blurred = scene();
  blurred.smear = &how;
  // On a level where a wrong place of a few pixels matters little.
  const int level =
      finest(pattern, map_of_pose(pattern, camera_, pose), static_cast<int>(blurred.pyramid.size()))
          .frame_level +
      1;
  if (level >= static_cast<int>(blurred.pyramid.size())) return false;
  double best = 0.0;
  double likeness = look(pattern, scene(), level, pose).likeness + kClearer;
  for (int quarter = 1; quarter <= 4; ++quarter) {
    how.share = 0.25 * quarter;
    const double now = look(pattern, blurred, level, pose).likeness;
    if (now <= likeness) continue;
    likeness = now;
    best = how.share;
  }
  smear_ = best;
  how.share = best;
  if (best == 0.0) return false;
  Pose tried = predicted;
  Fit seen;
  if (!settle(pattern, blurred, Reach::kFrame, tried, seen) || seen.likeness <= fit.likeness) {
    return false;
  }
  pose = tried;
  fit = seen;
  return true;
}

bool FrameTracker::follow_pose(const TrackedPattern& pattern, Track& track, Fit& fit) {
  const Pose predicted = track.moving ? continued(track.before, track.pose) : track.pose;
  Pose pose = predicted;
  bool found = settle(pattern, scene(), Reach::kFrame, pose, fit);
  const bool unsmeared = unsmear(pattern, track, predicted, pose, fit);
  found = found || unsmeared;
  if (!unsmeared && fit.likeness > track.likeness) track.likeness = fit.likeness;
  track.likeness *= kForgetting;
  if (!found || (!unsmeared && fit.share() < kSuspicious * track.share)) {
    const Fit seen = fit;
    if (!found) fit = {};
    found = find_again(pattern, track, predicted, pose, fit);
    if (!found) fit = seen;
  }
  if (!found) return false;
  track.share = 0.8 * track.share + 0.2 * fit.share();
  track.before = track.pose;
  track.pose = pose;
  track.moving = true;
  return true;
}

bool FrameTracker::follow(const TrackedPattern& pattern, Track& track, Detection& detection) {
  const Track last = track;
  Fit fit;
  bool found = false;
  if (track.by_map) {
    found = settle_map(pattern, scene(), track.map, fit);
    const auto pose = nearest_pose(pattern, camera_, track.map);
    found = found && pose.has_value();
    if (found) track.pose = *pose;
  } else {
    found = follow_pose(pattern, track, fit);
  }
  if (found && report(pattern, track, detection)) {
    detection.matches = fit.visible;
    detection.inliers = fit.held;
    return true;
  }
  track = last;
  track.moving = false;
  const Pose expected = last.moving ? continued(last.before, last.pose) : last.pose;
  const PlaneMap map = last.by_map ? last.map : map_of_pose(pattern, camera_, expected);
  track.told = in_view(pattern, map, camera_) ? Reason::kLostByBlur : Reason::kOutOfView;
  return false;
}

}  // namespace modar::tracker
