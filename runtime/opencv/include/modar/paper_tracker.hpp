// The method of the ModAR paper, by OpenCV: on a workstation only, and not installed.
#pragma once

#include <cstdint>
#include <memory>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/image.hpp"
#include "modar/tracker.hpp"

namespace modar {

/// The pipeline of the ModAR paper (README cites it), by OpenCV: detect, describe, match by brute
/// force with cross-check, RANSAC homography, Levenberg-Marquardt, corners, pose. The baseline for
/// PoseLoop, so nothing of PoseLoop goes into it.
class PaperTracker {
 public:
  /// Reads the patterns described with parameter set `set_id` from the bundle's mapped feature
  /// sections. Errors: kInvalidInput "tracker.no-patterns" if the bundle has none.
  static Result<std::unique_ptr<PaperTracker>> create(const BundleView& bundle,
                                                      std::uint32_t set_id, const Camera& camera);
  PaperTracker(const PaperTracker&) = delete;
  PaperTracker& operator=(const PaperTracker&) = delete;
  ~PaperTracker();

  /// One frame of the camera's size. Errors: kInvalidInput "tracker.frame-size", kInternal
  /// "tracker.opencv".
  Result<TrackResult> step(const GrayImage& frame);

 private:
  struct State;
  explicit PaperTracker(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
