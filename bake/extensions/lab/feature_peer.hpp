// OpenCV's SIFT and ORB with a robust homography: what planar trackers without our constraints do.
#pragma once

#include <cstdint>
#include <memory>

#include "formats/base/error.hpp"
#include "modar/image.hpp"
#include "modar/tracker.hpp"

namespace modar {

/// Lowe, "Distinctive image features from scale-invariant keypoints" (2004); Rublee et al., "ORB"
/// (2011); Barath et al., "MAGSAC++" (2020), as OpenCV has them.
enum class PeerMethod : std::uint8_t {
  kSiftMagsac,
  kSiftRansac,
  kOrbRansac  ///< 2,000 features, else OpenCV's defaults
};

/// Matches by ratio (0.8), then a free homography of eight numbers (3 pixels, at least 12 inliers).
/// One pattern; every frame on its own; corners only, no pose.
class FeaturePeer {
 public:
  static std::unique_ptr<FeaturePeer> create(const GrayImage& pattern, PeerMethod method);
  ~FeaturePeer();
  /// Errors: kInternal "bench.peer" (what OpenCV throws).
  Result<TrackResult> step(const GrayImage& frame);

 private:
  struct State;
  explicit FeaturePeer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
