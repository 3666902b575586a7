// A loop record (section type 258) as typed arrays, once every count and place in it is known to be
// sound. The checker and the pose loop read it through this.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "formats/tracker_record.hpp"

namespace modar {

/// Spans into the section's bytes, which must outlive them.
struct TrackerRecordView {
  TrackerRecordHeader header{};
  std::span<const TrackerFeatureRecord> features;
  std::span<const std::uint8_t> codes;
  std::span<const TrackerPatchRecord> patches;
  std::span<const std::uint8_t> pixels;  ///< all levels, the finest first
};

struct TrackerFault {
  std::uint64_t offset = 0;  ///< from the start of the section
  const char* cause = "";
};

/// Holds a section's bytes, aligned to 8, against bundle.md; nothing where they follow it. Of the
/// describer's version nothing is said here: a reader refuses those that it does not know.
std::optional<TrackerFault> view_tracker_record(std::span<const std::byte> bytes,
                                                TrackerRecordView& view);

}  // namespace modar
