// Holds patterns from frame to frame, once they were found. Internal to runtime/track.
#pragma once

#include <memory>

#include "modar/tracker.hpp"
#include "modar/tracker_features.hpp"
#include "patch_cache.hpp"
#include "refine_pose.hpp"

namespace modar::tracker {

inline constexpr int kLately = 60;  ///< frames for which a lost pattern is looked for first

/// What is known of a pattern from frame to frame.
struct Track {
  bool held = false;
  bool by_map = false;  ///< no pose of the camera explains it: its own map is followed
  bool moving = false;  ///< two poses in sequence tell a motion
  Pose pose;
  Pose before;
  PlaneMap map;         ///< where by_map
  double share = 1;     ///< of the patches in view, how many hold; of the frames before
  double likeness = 0;  ///< of the patches, of the sharp frames before
  int since_lost = kLately;
  Reason told = Reason::kNoFeatures;  ///< by the last search
};

/// What the frames so far tell of all patterns, and the present one.
class FrameTracker {
 public:
  FrameTracker(const Camera& camera, const DetectOptions& options);
  /// The present frame, which must stay until the next.
  void set_frame(const GrayImage& frame) { eye_->set_frame(frame); }
  [[nodiscard]] FeatureExtractor& eye() { return *eye_; }
  [[nodiscard]] Scene scene() const { return {camera_, eye_->pyramid(), kernels_, *patches_}; }
  /// Brings a track to the present frame; false where the pattern is lost, and why in track.told.
  bool follow(const TrackedPattern& pattern, Track& track, Detection& detection);
  /// Where the track lies, without counts; false where no camera sees a pattern so.
  bool report(const TrackedPattern& pattern, const Track& track, Detection& detection) const;

 private:
  bool follow_pose(const TrackedPattern& pattern, Track& track, Fit& fit);
  bool find_again(const TrackedPattern& pattern, const Track& track, const Pose& predicted,
                  Pose& pose, Fit& fit) const;
  bool unsmear(const TrackedPattern& pattern, const Track& track, const Pose& predicted, Pose& pose,
               Fit& fit);

  Camera camera_;
  const Kernels& kernels_;
  std::unique_ptr<FeatureExtractor> eye_;
  std::unique_ptr<PatchCache> patches_ = std::make_unique<PatchCache>();
  double smear_ = 0;  ///< share of a frame's time that the shutter is open, as blur tells
};

}  // namespace modar::tracker
