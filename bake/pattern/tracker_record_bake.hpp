// The pattern's record for our own pose loop: many rendered views, the descriptors that repeat
// best, and patches for tracking.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/error.hpp"
#include "modar/image.hpp"

namespace modar {

struct TrackerRecordOptions {
  std::uint32_t features = 3000;          ///< descriptors kept, at most
  std::uint32_t trial_views = 120;        ///< random renderings that show which ones repeat
  std::uint32_t patches_per_level = 256;  ///< at most
  bool score = true;                      ///< bake_pattern() scores the picture, too
  unsigned jobs = 1;                      ///< threads; the bytes do not depend on it
  [[nodiscard]] Result<void> validate() const;
};

/// The bytes of a SectionType::kTrackerRecord section. pattern: 8-bit gray, at most 1023 pixels a
/// side. The same picture gives the same bytes on every machine. Errors: kInvalidInput
/// "pattern.loop-size"; "pattern.no-features" where nothing repeats.
Result<std::vector<std::byte>> bake_tracker_record(const GrayImage& pattern,
                                                   const TrackerRecordOptions& options);

}  // namespace modar
