// OpenCV's SIFT with MAGSAC: what a planar tracker without our constraints of time would do.
#pragma once

#include <memory>

#include "formats/error.hpp"
#include "modar/image.hpp"
#include "modar/tracker.hpp"

namespace modar {

/// Lowe, "Distinctive image features from scale-invariant keypoints" (2004); Barath et al.,
/// "MAGSAC++" (2020), both as OpenCV has them. One pattern; corners only, no pose.
class SiftTracker {
 public:
  static std::unique_ptr<SiftTracker> create(const GrayImage& pattern);
  ~SiftTracker();
  /// Errors: kInternal "bench.sift" (what OpenCV throws).
  Result<TrackResult> step(const GrayImage& frame);

 private:
  struct State;
  explicit SiftTracker(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
