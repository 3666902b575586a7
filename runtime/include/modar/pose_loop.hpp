// Our own pose loop: detect a pattern once, then track it. No OpenCV.
#pragma once

#include <memory>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/camera.hpp"
#include "modar/image.hpp"
#include "modar/tracker.hpp"
#include "modar/tracker_features.hpp"

namespace modar {

struct PoseLoopOptions {
  DetectOptions detect;
  bool track = true;      ///< false: every frame is searched anew
  int search_every = 10;  ///< frames between searches for further patterns while one is tracked
  /// Searches on a thread of its own, on the newest frame, while tracking goes on: no frame waits,
  /// but what is found depends on time. False: the same frames always give the same results.
  bool apart = false;
};

/// Reads the patterns' loop records (section type 258) from the bundle's mapped bytes, which must
/// outlive it. Allocates nothing per frame once a TrackResult has grown.
class PoseLoop {
 public:
  /// Errors: kInvalidInput "tracker.no-patterns" where no pattern has a loop record,
  /// "tracker.record"; kUnsupported "tracker.record-version".
  static Result<std::unique_ptr<PoseLoop>> create(const BundleView& bundle, const Camera& camera,
                                                  const PoseLoopOptions& options = {});
  PoseLoop(const PoseLoop&) = delete;
  PoseLoop& operator=(const PoseLoop&) = delete;
  ~PoseLoop();

  /// One frame of the camera's size. inliers of a detection: features that agree where it was
  /// detected, patches that hold where it was tracked.
  /// Errors: kInvalidInput "tracker.frame-size".
  Result<TrackResult> step(const GrayImage& frame);
  /// The same into a result of the caller's, whose memory is used again.
  Result<void> step(const GrayImage& frame, TrackResult& result);
  /// Forgets what it tracks.
  void reset();

 private:
  struct State;
  explicit PoseLoop(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
