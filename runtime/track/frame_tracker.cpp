// Predict, align; under blur, align blurred templates; if that fails, look further away.
#include "frame_tracker.hpp"

#include <algorithm>

#include <glm/geometric.hpp>

namespace modar::tracker {
namespace {

// Share of the inlier ratio of the frames before under which a fit may be a neighbouring place:
// other starts are tried. Higher costs time under every passing hand; 0.375 to 0.9 change no pose
// of `modar-lab bench wild`, 1.05 (every frame) worsens the 95th percentile.
constexpr double kSuspicious = 0.75;
// Share of a coarser level's inlier ratio with which a sharp fit on a finer one stays: higher lets
// what covers a print draw it away. Swept on prints covered to 70 %, held for 3 frames: 88.9, 87.5,
// 80.6 and 75.0 % right with 0, 0.6, 0.8 and 1; half covered 100, 100, 97.2 and 95.8 %.
constexpr double kSharpShare = 0.6;
// And under which the pose is not shown: blur and a jerk had put it 37 to 74 pixels beside, at 0.34
// to 0.48 of that ratio. After so many such frames it is lost: a search tells whether something
// covers the pattern, or the pose is wrong.
constexpr double kDoubtful = 0.5;
constexpr int kMaxDoubts = 3;
// Pixels by which the last prediction missed: up to them, refinement starts on the finest level or
// one above, whose patches reach that far, and starts anew two above where that does not fit.
// Smaller values cost time, larger ones a lost start more often.
constexpr double kNearSurprise = 1.0;
constexpr double kCloseSurprise = 2.5;
// Way of the pattern's centre between frames, pixels: less blurs too little to matter, and what
// moves further is rarely found by the first alignment.
constexpr double kMinBlurringWay = 4.0;
constexpr double kMaxBlurringWay = 80.0;
// Blurred templates must raise the mean correlation by so much to be used: below it is noise.
constexpr double kMinBlurGain = 0.02;
// A frame is suspected of blur if its correlation falls under so much of the sharp frames', which
// fades by kFading a frame so that a change of light does not count as blur for ever. Swept on
// tracking fast: corners jump by 0.65, 0.57 and 0.57 pixels with 0.9, 0.96 and 0.98, and by 0.65
// and 0.57 with a fading of 0.95 and 0.99; all poses are right.
constexpr double kBlurred = 0.96;
constexpr double kFading = 0.99;

}  // namespace

[[gnu::cold]] FrameTracker::FrameTracker(const Camera& camera, const DetectOptions& options)
    : camera_(camera),
      kernels_(kernels(options.simd)),
      extractor_(FeatureExtractor::create(camera.width, camera.height, options)) {}

bool FrameTracker::locate(const TrackedPattern& pattern, const Track& track,
                          Detection& detection) const {
  detection.pattern = pattern.index;
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

/// Pixels between the pattern's centre at two poses.
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
/// what covers a print draws its pose away, and chance brings more inliers: they do not stand
/// against what fits sharply on finer ones.
bool FrameTracker::refine_predicted(const TrackedPattern& pattern, const Track& track, Pose& pose,
                                    PatchFit& fit) const {
  Pose near = pose;
  PatchFit near_fit;
  bool near_found = false;
  if (!track.has_motion || track.surprise < kCloseSurprise) {
    const bool close = track.has_motion && track.surprise >= kNearSurprise;
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
  // Nothing is known of the frames before a find: what is covered there is not suspected.
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
  track.restless = fit.restless() ? track.restless + 1 : 0;
  if (track.doubts == 0) track.inlier_ratio = 0.8 * track.inlier_ratio + 0.2 * ratio;
  track.surprise = distance(pattern, predicted, pose);
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
  return false;
}

}  // namespace modar::tracker
