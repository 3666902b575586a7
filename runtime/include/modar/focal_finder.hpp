// The focal length of an uncalibrated camera, from the patterns that it sees anyway.
#pragma once

#include <memory>
#include <optional>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// The state of a FocalFinder, and what it needs to be done. The three limits trade the time to
/// find a focal length for its accuracy; with them rendered views are within 1 % of the truth.
struct FocalProgress {
  static constexpr int kMinViews = 8;
  static constexpr double kMaxDeviation = 0.01;
  static constexpr double kMinScatterDeg = 8;
  int frames = 0;        ///< frames taken
  int frontal = 0;       ///< detections in them with too little perspective: frontal, or far away
  int views = 0;         ///< detections used; kMinViews are needed
  double deviation = 0;  ///< relative standard deviation of the focal length; at most
                         ///< kMaxDeviation is needed; 0: unknown
  /// Standard deviation of the planes' normals in the direction of most scatter, degrees;
  /// kMinScatterDeg is needed: distortion and a principal point off the centre bias all planes of
  /// one tilt alike, and only other tilts show it.
  double scatter_deg = 0;
};

/// Searches the frames it is given for the bundle's patterns. Each view of a tilted plane
/// constrains the focal length (Zhang, "A flexible new technique for camera calibration", 2000,
/// with the principal point in the frame's centre and square pixels); many views determine it.
/// Detections are aligned with the frame to a fraction of a pixel first. Strongly distorting lenses
/// need `modar calibrate`.
class FocalFinder {
 public:
  /// Frames have that size. The bundle's bytes must outlive it. Errors: those of
  /// PoseLoop::create().
  static Result<std::unique_ptr<FocalFinder>> create(const BundleView& bundle, int width,
                                                     int height);
  FocalFinder(const FocalFinder&) = delete;
  FocalFinder& operator=(const FocalFinder&) = delete;
  ~FocalFinder();

  /// Takes a frame of the size given to create(). Costs about a search of PoseLoop; allocates
  /// nothing. True if it added a view.
  bool add_frame(const GrayImage& frame);
  /// Pixels; none until progress() meets its limits.
  [[nodiscard]] std::optional<double> focal() const;
  [[nodiscard]] FocalProgress progress() const;

 private:
  struct State;
  explicit FocalFinder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
