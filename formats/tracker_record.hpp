// The tracker record of a pattern: its features, patches and image, as the tracker uses them in
// place (SectionType::kTrackerRecord). bundle.md is the normative text. Numbers
// are little-endian, reserved fields are zero. Checker and tracker read it through
// view_tracker_record().
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace modar {

/// Of the feature extractor whose codes these records hold; the only one so far.
inline constexpr std::uint32_t kTrackerExtractorVersion = 1;
inline constexpr std::uint32_t kTrackerBlockCodes = 32;  ///< codes in a block
inline constexpr std::uint32_t kTrackerCodeBytes = 32;   ///< 256 bits
inline constexpr std::uint32_t kMaxTrackerFeatures = 65536;
inline constexpr std::uint32_t kMaxTrackerPatches = 4096;
inline constexpr std::uint32_t kMaxTrackerImageLevels = 8;

/// Start of the section. Offsets count from the start of the section.
struct TrackerRecordHeader {
  std::uint32_t describer_version;  ///< kTrackerExtractorVersion
  std::uint32_t feature_count;  ///< a multiple of kTrackerBlockCodes; the first bright_count are of
  std::uint32_t bright_count;   ///< corners with a brighter arc; a multiple of it, too
  std::uint32_t patch_count;
  std::uint32_t width;  ///< of the pattern's image, 1 to 1023
  std::uint32_t height;
  std::uint32_t level_count;  ///< of patches: each halves the one before, rounding down
  std::uint32_t reserved0;
  std::uint64_t features_offset;  ///< TrackerFeatureRecord[feature_count]
  std::uint64_t codes_offset;  ///< a multiple of 64; blocks of kTrackerBlockCodes codes: byte 0 of
                               ///< all codes of the block, then byte 1, ...
  std::uint64_t patches_offset;  ///< TrackerPatchRecord[patch_count], by level
  std::uint64_t pixels_offset;   ///< of the image, 8-bit gray, rows without padding
  std::uint64_t reserved1[8];
};
static_assert(sizeof(TrackerRecordHeader) == 128);

/// A feature as some view of the pattern showed it. Groups are filled up to whole blocks by
/// repeating their last feature.
struct TrackerFeatureRecord {
  std::uint16_t x;  ///< of the pattern's image, from its left edge, in 1/64 pixels
  std::uint16_t y;
  /// Image pixels around the feature to pixels of the oriented patch, row by row, in 1/4096.
  std::int16_t warp[4];
};
static_assert(sizeof(TrackerFeatureRecord) == 12);

/// A patch with enough texture to measure a position.
struct TrackerPatchRecord {
  std::uint16_t x;  ///< of level 0, from its left edge, in 1/64 pixels
  std::uint16_t y;
  std::uint16_t level;  ///< of the image that the patch is cut from
  std::uint16_t score;  ///< least eigenvalue of its gradient matrix, gray values a pixel, in 1/64
};
static_assert(sizeof(TrackerPatchRecord) == 8);

/// Spans into the section's bytes, which must outlive them.
struct TrackerRecordView {
  TrackerRecordHeader header{};
  std::span<const TrackerFeatureRecord> features;
  std::span<const std::uint8_t> codes;
  std::span<const TrackerPatchRecord> patches;
  std::span<const std::uint8_t> pixels;  ///< of the image, width * height
};

struct TrackerFault {
  std::uint64_t offset = 0;  ///< from the start of the section
  const char* cause = "";
};

/// Validates a section's bytes, aligned to 8, against bundle.md and points `view` into them;
/// nullopt if they are valid. describer_version is not judged: a reader refuses those it does not
/// know.
std::optional<TrackerFault> view_tracker_record(std::span<const std::byte> bytes,
                                                TrackerRecordView& view);

}  // namespace modar
