// A pattern made on the spot: four corners in a frame, as the ModAR paper's app lets its users.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <glm/vec2.hpp>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/image.hpp"
#include "runtime/platform/semaphore.hpp"

namespace modar {

/// A bundle of that one pattern in memory. view points into bytes: neither copied nor moved.
struct SpotPattern {
  std::vector<std::byte> bytes;
  BundleView view;
};

/// The four corners in the order top-left, top-right, bottom-right, bottom-left, whatever order
/// they were clicked in. Errors: kUsage "spot.corners" where they make no convex four-sided figure,
/// or one smaller than 24 pixels a side.
Result<std::array<glm::dvec2, 4>> ordered_corners(const std::array<glm::dvec2, 4>& clicked);

/// Rectifies the area between the corners (pixels of the frame) and describes it with
/// `parameters`. Errors: those of ordered_corners(); kInvalidInput "spot.features" where nothing is
/// found on it; kUnsupported "spot.unsupported" in a build without OpenCV.
Result<std::shared_ptr<const SpotPattern>> make_spot_pattern(
    const RgbImage& frame, const std::array<glm::dvec2, 4>& clicked,
    const ParameterSetRecord& parameters);

/// Hands a new T from the render thread to the vision thread.
template <class T>
class Slot {
 public:
  void put(std::shared_ptr<const T> fresh) {
    guard_.acquire();
    held_.swap(fresh);
    guard_.release();
  }
  /// Null where nothing was put since the last call.
  std::shared_ptr<const T> take() {
    std::shared_ptr<const T> taken;
    guard_.acquire();
    taken.swap(held_);
    guard_.release();
    return taken;
  }

 private:
  Semaphore guard_{1};
  std::shared_ptr<const T> held_;
};
using SpotSlot = Slot<SpotPattern>;

}  // namespace modar
