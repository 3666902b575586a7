// A picture to the record by which the tracker finds it: what `modar bake` puts into a bundle, and
// apps make of pictures that visitors take. Needs no OpenCV.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/pattern_shape.hpp"
#include "modar/image.hpp"

namespace modar {

struct TrackerRecordOptions {
  /// Descriptors kept, at most. More find harder views, and cost matching time and 44 bytes each.
  std::uint32_t features = 2880;
  /// Random renderings that decide which descriptors are kept. More make a better choice and a
  /// slower bake: of prints on 2 to 5 % of the frame, 53.3, 56.7 and 57.5 % of the poses are right
  /// with 60, 120 and 240.
  std::uint32_t trial_views = 120;
  /// Tracked patches of each halving of the picture, at most: a frame uses a few dozen of them, the
  /// rest stand by where those are covered. The most that a record holds: 70 % covered, 89.2 % of
  /// the poses are right with them, 72.5 % with half.
  std::uint32_t patches_per_level = 256;
  bool score = true;  ///< the bake scores the picture, too
  unsigned jobs = 1;  ///< threads; the bytes do not depend on it
  [[nodiscard]] Result<void> validate() const;
};

/// Whether a record can be made of a picture with these sides, pixels: places in 64ths take 16
/// bits.
constexpr bool is_pattern_size(int width, int height) {
  return width >= 32 && height >= 32 && width <= 1023 && height <= 1023;
}

/// The bytes of a SectionType::kTrackerRecord section. pattern: 8-bit gray, at most 1023 pixels a
/// side. The same picture gives the same bytes on every machine. Errors: kInvalidInput
/// "pattern.loop-size"; "pattern.no-features" where nothing repeats. surface: of the pattern.
/// repeated: becomes the mean number of features that a random view repeats.
Result<std::vector<std::byte>> make_tracker_record(const GrayImage& pattern,
                                                   const TrackerRecordOptions& options,
                                                   const PatternSurface& surface = {},
                                                   double* repeated = nullptr);

}  // namespace modar
