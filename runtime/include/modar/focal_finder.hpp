// The focal length of a camera that nobody has calibrated, from the patterns that it sees anyway.
#pragma once

#include <memory>
#include <optional>

#include "formats/bundle_view.hpp"
#include "formats/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Looks for the bundle's patterns in frames now and then. Each view of a tilted plane tells the
/// focal length (Zhang, "A flexible new technique for camera calibration", 2000, with the principal
/// point in the frame's middle and square pixels); many views tell it well. Lenses that bend much
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

  /// A frame of the size of create(), about as dear as a search of PoseLoop; allocates nothing.
  /// True where a view was added.
  bool look(const GrayImage& frame);
  /// Pixels; nothing before it is known to about 1 % (one standard deviation).
  [[nodiscard]] std::optional<double> focal() const;
  [[nodiscard]] int views() const;

 private:
  struct State;
  explicit FocalFinder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
