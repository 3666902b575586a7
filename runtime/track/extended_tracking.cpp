// What extended tracking learns, follows and corrects.
#include "extended_tracking.hpp"

#include <algorithm>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "photometry.hpp"
#include "plane_geometry.hpp"
#include "pose_refinement.hpp"

namespace modar::tracker {
namespace {

// Frames between attempts to find a covered pattern where its surroundings predict it. Fewer find
// it sooner and take as long as tracking.
constexpr int kLookEvery = 4;

}  // namespace

void ExtendedTracking::reset() {
  surroundings_.clear();
  following_ = guessed_ = false;
  blend_ = {};
  last_offset_.reset();
}

/// Learns the surroundings from a frame that shows the anchor pattern, or else derives its pose
/// from them. What the pattern itself says wins wherever it is shown: following the surroundings
/// from half-covered patterns on made 0.66 px of three rendered videos into 3.5 (`modar-lab bench
/// extended --only partly`, 95th percentile). But little of a pattern is nothing to learn from, so
/// they are followed meanwhile.
void ExtendedTracking::step(TrackResult& result, const glm::dvec3* turn) {
  Detection* shown = choose_anchor(result);
  Track& track = tracks_[anchor_];
  const bool was = following_;
  const bool doubtful = shown != nullptr && (track.has_motion || was) && doubts(*shown);
  Detection followed;
  following_ = (shown == nullptr || doubtful || was) && !track.homography_only &&
               follow_surroundings(shown == nullptr, turn, followed);
  if (shown == nullptr || doubtful) last_offset_.reset();
  constexpr double kForgotten = 0.98;  // of the usual patches, a frame: half in a second
  usual_patches_ *= kForgotten;
  if (shown != nullptr) {
    if (following_ && guessed_) start_blend(followed.pose, shown->pose);
    if (!doubtful && (!following_ || seen_twice(*shown, followed))) {
      usual_patches_ = std::max(usual_patches_, 1.0 * shown->inliers);
      if (following_) surroundings_.correct(followed.pose, shown->pose);
      following_ = false;
      surroundings_.learn(frames_.frame(), shown->pose, shown->corners, shown->inliers, turn);
    }
    guessed_ = false;
    continue_blend(*shown);
    return;
  }
  guessed_ = following_ && !(track.tracked && track.shown_reason == Reason::kOtherPrint);
  if (!following_) {
    blend_ = {};
    return;
  }
  const Pose known = followed.pose;
  continue_blend(followed);
  if (!guessed_) return;
  if (!track.tracked && ++frames_unseen_ % kLookEvery == 0) find_again(known);
  result.visible.push_back(followed);
}

/// The detection of the anchor pattern in this frame, or null if it is not shown. Chooses another
/// anchor if no surroundings would be lost.
Detection* ExtendedTracking::choose_anchor(TrackResult& result) {
  Detection* largest = nullptr;
  double most = 0;
  for (Detection& one : result.visible) {
    if (patterns_[anchor_].shown_by(one.pattern, one.copy)) return &one;
    const glm::dvec2 a = one.corners[2] - one.corners[0];
    const glm::dvec2 b = one.corners[3] - one.corners[1];
    const double area = std::abs(a.x * b.y - a.y * b.x);
    if (area <= most) continue;
    most = area;
    largest = &one;
  }
  if (largest == nullptr || following_ || surroundings_.ready()) return nullptr;
  for (std::size_t i = 0; i < patterns_.size(); ++i) {
    if (patterns_[i].shown_by(largest->pattern, largest->copy)) anchor_ = i;
  }
  surroundings_.clear();
  usual_patches_ = 0;
  return largest;
}

/// Whether so little of the anchor pattern fits, or is in view, that its surroundings had better
/// not be learned from its pose.
bool ExtendedTracking::doubts(const Detection& seen) const {
  // Share of the patches in view that must fit before surroundings are learned. Lower learns from
  // covered patterns, whose poses are wrong. [0.25, 0.75] tuned: extended
  constexpr double kMinInlierShare = 0.5;
  // Share of fitting patches below which known surroundings decide. Lower trusts covered patterns.
  // [0.6, 0.95] tuned: extended
  constexpr double kSureInlierShare = 0.8;
  // Share of the usual number of patches below which known surroundings decide.
  constexpr double kUsualShare = 0.5;
  // Patches from which the pattern's own pose is trusted. Fewer trust small patterns. [40, 160]
  // tuned: extended
  constexpr int kSurePatches = 80;
  // Share of the surroundings that must agree with a pose of few patches. Lower trusts small
  // patterns more. [0.3, 0.9] tuned: extended
  constexpr double kContradicted = 0.6;
  const double share = 1.0 * seen.inliers / std::max(seen.matches, 1);
  if (share < kMinInlierShare) return true;
  if ((share < kSureInlierShare || seen.inliers < kUsualShare * usual_patches_) &&
      surroundings_.ready())
    return true;
  if (share >= kSureInlierShare && seen.inliers >= kSurePatches) return false;
  return surroundings_.agreement(frames_.frame(), seen.pose) < kContradicted;
}

/// The pose of the anchor pattern from its surroundings. shown: the frame shows that pose.
bool ExtendedTracking::follow_surroundings(bool shown, const glm::dvec3* turn,
                                           Detection& detection) {
  if (!following_ && !surroundings_.ready()) return false;
  ExtendedPose extended;
  if (!surroundings_.follow(frames_.frame(), turn, extended)) {
    return false;
  }
  detection.pattern = patterns_[anchor_].index;
  detection.copy = patterns_[anchor_].copy;
  detection.pose = extended.pose;
  detection.extended = true;
  detection.position_sigma = extended.position_sigma;
  detection.rotation_sigma = extended.rotation_sigma;
  if (!corners_of(extended.pose, detection.corners)) return false;
  if (shown) smooth_correction(extended, detection.corners);
  return true;
}

/// Points that come into view again may correct the pose abruptly: spreads the correction over
/// several frames.
void ExtendedTracking::smooth_correction(const ExtendedPose& extended,
                                         const std::array<glm::dvec2, 4>& corners) {
  constexpr double kCorrected = 4.0;  // pixels from the corners that motion predicts; not measured
  const auto in_frame = [&](glm::dvec2 p) {
    return p.x >= 0 && p.y >= 0 && p.x < camera_.width && p.y < camera_.height;
  };
  if (std::none_of(corners.begin(), corners.end(), in_frame))
    return;  // far out, pixels mean little
  const Pose* nearest = nullptr;
  double least = 0;
  for (const Pose& expected : extended.expected) {
    std::array<glm::dvec2, 4> there;
    if (!corners_of(expected, there)) continue;
    const double way = corner_distance(there, corners);
    if (nearest == nullptr || way < least) {
      nearest = &expected;
      least = way;
    }
  }
  if (nearest != nullptr && least > kCorrected) start_blend(*nearest, extended.pose);
}

bool ExtendedTracking::corners_of(const Pose& pose, std::array<glm::dvec2, 4>& corners) const {
  return map_corners(patterns_[anchor_], map_of_pose(patterns_[anchor_], camera_, pose), corners);
}

/// Whether two consecutive frames measure the same offset of the anchor pattern from the pose of
/// the surroundings: the first features of a pattern that comes back can give any pose.
bool ExtendedTracking::seen_twice(const Detection& seen, const Detection& followed) {
  // Share of the outline's diagonal within which two poses are the same. Higher smooths more
  // corrections.
  constexpr double kSame = 0.02;
  std::array<glm::dvec2, 4> now;
  for (std::size_t i = 0; i < 4; ++i) now[i] = seen.corners[i] - followed.corners[i];
  const double diagonal = std::max(glm::length(followed.corners[2] - followed.corners[0]),
                                   glm::length(followed.corners[3] - followed.corners[1]));
  const bool twice =
      last_offset_.has_value() && corner_distance(now, *last_offset_) < kSame * diagonal;
  last_offset_ = now;
  return twice;
}

/// Tries to find the anchor pattern where its surroundings place it, and tracks it.
void ExtendedTracking::find_again(const Pose& followed) {
  const TrackedPattern& pattern = patterns_[anchor_];
  const PlaneMap map = map_of_pose(pattern, camera_, followed);
  if (!in_view(pattern, map, camera_)) return;
  Track next;
  next.pose = followed;
  PatchFit fit;
  Detection detection;
  if (!refine(pattern, frames_.frame(), SearchRadius::kFrame, next.pose, fit) ||
      photometric_percent(pattern, frames_.frame(), next.pose) < kMinPercent ||
      !frames_.locate(pattern, next, detection)) {
    return;
  }
  next.tracked = true;
  tracks_[anchor_] = next;
}

/// `pose` with the part of the correction that is not yet applied.
Pose ExtendedTracking::blended(const Pose& pose) const {
  return {rotation_matrix(blend_.share * blend_.rotation) * pose.rotation,
          pose.translation + blend_.share * blend_.translation};
}

/// Starts a correction of the shown pose from `from` to `to`.
void ExtendedTracking::start_blend(const Pose& from, const Pose& to) {
  // Shortest and longest correction, in frames, and the pixels by which it moves the corners per
  // frame: a slower one shows the wrong pose for longer. Not measured.
  constexpr double kFrames = 10;
  constexpr double kMostFrames = 40;
  constexpr double kStep = 3.0;
  const Pose shown = blended(from);
  std::array<glm::dvec2, 4> shown_corners;
  std::array<glm::dvec2, 4> corners;
  const bool known = corners_of(shown, shown_corners) && corners_of(to, corners);
  const double way = known ? corner_distance(shown_corners, corners) : 0;
  blend_.rotation = rotation_vector(shown.rotation * glm::transpose(to.rotation));
  blend_.translation = shown.translation - to.translation;
  blend_.share = 1;
  blend_.step = 1 / std::clamp(way / kStep, kFrames, kMostFrames);
}

void ExtendedTracking::continue_blend(Detection& detection) {
  if (blend_.share <= 0) return;
  Track shown;
  shown.pose = blended(detection.pose);
  if (frames_.locate(patterns_[anchor_], shown, detection)) {
    if (!detection.extended) {
      detection.rotation_sigma = seen_sigma(detection.inliers);
      detection.position_sigma = detection.rotation_sigma * glm::length(detection.pose.translation);
    }
    detection.extended = true;
    detection.position_sigma += blend_.share * glm::length(blend_.translation);
    detection.rotation_sigma += blend_.share * glm::length(blend_.rotation);
  }
  blend_.share -= blend_.step;
}

}  // namespace modar::tracker
