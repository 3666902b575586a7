// The camera and the flat patterns' aspects, estimated from the frames while no camera was given.
// Internal to runtime/track.
#pragma once

#include <cstddef>
#include <span>

#include "camera_estimator.hpp"
#include "frame_tracker.hpp"
#include "modar/pose_loop.hpp"

namespace modar::tracker {

/// Measures free homographies of tracked flat patterns, and sets the focal length and the patterns'
/// shapes by them.
class SelfCalibration {
 public:
  /// All of these must outlive it: the camera that it sets; one track a pattern; frames: holds the
  /// present frame.
  SelfCalibration(Camera& camera, std::span<TrackedPattern> patterns, std::span<Track> tracks,
                  const FrameTracker& frames)
      : camera_(camera),
        patterns_(patterns),
        tracks_(tracks),
        frames_(frames),
        estimator_(camera, patterns.size()) {}

  /// Once a frame, before its patterns: continues with the focal length and the aspects estimated
  /// from the views so far. True if the focal length has moved so far that everything learned with
  /// it is wrong.
  bool apply();
  /// Measures a tracked flat pattern's free homography: what it says of the camera, and what a pose
  /// leaves of it, since no camera explains the pictures of a stabilised or distorting one.
  /// False where it is found anew and its patches contradict each other on any plane.
  bool measure(std::size_t i, Detection& detection);
  /// A pattern is found anew, by the aspect alone: forgets what its last track's pose left of it.
  void forget_plane(std::size_t i) {
    if (patterns_[i].surface.flat()) patterns_[i].shape = {1.0, 0.0, 0.0, aspect(i)};
  }
  /// Poses as others use them, in place of those by which the loop splits its maps.
  void place_pictures(TrackResult& result) const;
  [[nodiscard]] CameraEstimate estimate() const { return estimator_.estimate(); }
  [[nodiscard]] double aspect(std::size_t i) const { return estimator_.aspect(i); }

 private:
  bool view_plane(const TrackedPattern& plane, const Pose& pose, CameraEstimator::View& view,
                  PlaneSplit& split) const;
  bool measure_first(std::size_t i, CameraEstimator::View& view, bool& open, bool& inconsistent);
  bool measure_again(std::size_t i, CameraEstimator::View& view);

  Camera& camera_;
  std::span<TrackedPattern> patterns_;
  std::span<Track> tracks_;
  const FrameTracker& frames_;
  CameraEstimator estimator_;
  double learned_focal_ = 0;  ///< that apply() last reported
};

}  // namespace modar::tracker
