// Tracks patterns from frame to frame, once they were found. Internal to runtime/track.
#pragma once

#include <memory>

#include "modar/tracker.hpp"
#include "modar/tracker_features.hpp"
#include "pose_refinement.hpp"
#include "reason_evidence.hpp"

namespace modar::tracker {

/// Frames in which a lost pattern is searched first, and in every frame. More find it sooner after
/// a hand passed, and take time.
inline constexpr int kRecentFrames = 60;

/// State of a pattern from frame to frame.
struct Track {
  bool tracked = false;
  bool homography_only = false;  ///< no pose of the camera explains it: its plane map is tracked
  bool has_motion = false;       ///< `previous` is the pose of the frame before
  Pose pose;
  Pose previous;
  PlaneMap map;             ///< if homography_only
  double inlier_ratio = 1;  ///< of the patches in view; running mean of the frames before
  double correlation = 0;   ///< of the patches, in the sharp frames before
  double prediction_error =
      1e9;               ///< pixels by which the last prediction missed the pattern's centre
  int doubts = 0;        ///< frames in a row whose fit contradicts the frames before: not shown
  int inconsistent = 0;  ///< frames in a row whose patches contradict each other
  int frames_since_lost = kRecentFrames;
  Reason last_reason = Reason::kNoFeatures;  ///< why it is not tracked
  LikelyPlace place;                         ///< where it may be, while it is not tracked
  Reason shown_reason = Reason::kVisible;    ///< why it is tracked and not shown, if it is not
  bool verified = false;                     ///< by the PrintVerifier
  bool measured = false;                     ///< by a free homography, while it is tracked
  int frames_to_measure = 0;                 ///< so again
};

/// The present frame, and the steps that move tracks to it.
class FrameTracker {
 public:
  FrameTracker(const Camera& camera, const DetectOptions& options);
  /// Sets the present frame, which must stay until the next.
  void set_frame(const GrayImage& frame) { extractor_->set_frame(frame); }
  [[nodiscard]] FeatureExtractor& extractor() { return *extractor_; }
  [[nodiscard]] FrameView frame() const {
    return {camera_, extractor_->pyramid(), kernels_, *patches_};
  }
  /// Moves a track to the present frame; false if the pattern is lost, with track.last_reason.
  bool update(const TrackedPattern& pattern, Track& track, Detection& detection);
  /// Fills in pattern, pose and corners; false if no camera could see the pattern there.
  bool locate(const TrackedPattern& pattern, const Track& track, Detection& detection) const;
  /// The place that it takes in the frame, for same_place().
  [[nodiscard]] std::array<glm::dvec2, 4> place(const TrackedPattern& pattern, const Track& track,
                                                const Detection& detection) const;
  /// Pixels between the pattern's centre at two poses.
  [[nodiscard]] double distance(const TrackedPattern& pattern, const Pose& a, const Pose& b) const;

 private:
  bool update_pose(const TrackedPattern& pattern, Track& track, PatchFit& fit);
  bool refine_predicted(const TrackedPattern& pattern, const Track& track, Pose& pose,
                        PatchFit& fit) const;
  bool reacquire(const TrackedPattern& pattern, const Track& track, const Pose& predicted,
                 Pose& pose, PatchFit& fit) const;
  bool refine_blurred(const TrackedPattern& pattern, const Track& track, const Pose& predicted,
                      Pose& pose, PatchFit& fit);

  const Camera& camera_;
  const Kernels& kernels_;
  std::unique_ptr<FeatureExtractor> extractor_;
  std::unique_ptr<PatchCache> patches_ = std::make_unique<PatchCache>();
  double exposure_ = 0;  ///< share of the frame interval, as estimated from the last blurred frame
};

}  // namespace modar::tracker
