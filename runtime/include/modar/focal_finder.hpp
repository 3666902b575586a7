// The focal length of a camera that nobody has calibrated, from the patterns that it sees anyway.
#pragma once

#include <memory>
#include <optional>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// How far a FocalFinder has come.
struct FocalProgress {
  static constexpr int kFewestViews = 8;
  static constexpr double kSure = 0.01;
  static constexpr double kScatter = 8;
  int looks = 0;         ///< frames looked at
  int faint = 0;         ///< detections in them with too little perspective: too frontal or too far
  int views = 0;         ///< detections that tell something; kFewestViews are needed
  double deviation = 0;  ///< of the focal length, relative; at most kSure is needed; 0: unknown
  /// Degrees, of the planes' normals about their mean, the way they scatter most; kScatter is
  /// needed: what a lens bends and a principal point off the middle pull all planes of one tilt the
  /// same way, and only others show it.
  double scatter_deg = 0;
};

/// Looks for the bundle's patterns in frames now and then. Each view of a tilted plane tells the
/// focal length (Zhang, "A flexible new technique for camera calibration", 2000, with the principal
/// point in the frame's middle and square pixels); many views tell it well. What is found is
/// aligned with the picture first, to a fraction of a pixel. Lenses that bend much need `modar
/// calibrate`.
class FocalFinder {
 public:
  /// Frames have that size. The bundle's bytes must outlive it. Errors: those of
  /// PoseLoop::create().
  static Result<std::unique_ptr<FocalFinder>> create(const BundleView& bundle, int width,
                                                     int height);
  FocalFinder(const FocalFinder&) = delete;
  FocalFinder& operator=(const FocalFinder&) = delete;
  ~FocalFinder();

  /// A frame of the size of create(), about as dear as a search of PoseLoop; allocates nothing.
  /// True where a view was added.
  bool look(const GrayImage& frame);
  /// Pixels; nothing before it is known to about 1 % (one standard deviation).
  [[nodiscard]] std::optional<double> focal() const;
  [[nodiscard]] FocalProgress progress() const;

 private:
  struct State;
  explicit FocalFinder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
