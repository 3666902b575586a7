// Validates tracker records.
#include "formats/tracker_record.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace modar {
namespace {

constexpr std::uint32_t kLargestSide = 1023;

/// Offset of a field of the header that breaks a rule, and which.
std::optional<TrackerFault> check_header(const TrackerRecordHeader& header) {
  const auto fault = [](std::uint64_t offset, const char* cause) {
    return std::optional<TrackerFault>({offset, cause});
  };
  if (header.feature_count > kMaxTrackerFeatures ||
      header.feature_count % kTrackerBlockCodes != 0) {
    return fault(offsetof(TrackerRecordHeader, feature_count),
                 "feature_count does not fill whole blocks");
  }
  if (header.bright_count > header.feature_count || header.bright_count % kTrackerBlockCodes != 0) {
    return fault(offsetof(TrackerRecordHeader, bright_count),
                 "bright_count does not fill whole blocks");
  }
  if (header.patch_count > kMaxTrackerPatches) {
    return fault(offsetof(TrackerRecordHeader, patch_count), "patch_count is too great");
  }
  if (header.width < 1 || header.width > kLargestSide || header.height < 1 ||
      header.height > kLargestSide) {
    return fault(offsetof(TrackerRecordHeader, width), "a side is not 1 to 1023 pixels");
  }
  if (header.level_count < 1 || header.level_count > kMaxTrackerImageLevels ||
      (std::min(header.width, header.height) >> (header.level_count - 1)) == 0) {
    return fault(offsetof(TrackerRecordHeader, level_count), "there are too many levels");
  }
  if (header.reserved0 != 0 || std::any_of(std::begin(header.reserved1), std::end(header.reserved1),
                                           [](std::uint64_t part) { return part != 0; })) {
    return fault(offsetof(TrackerRecordHeader, reserved0), "a reserved field is not zero");
  }
  return std::nullopt;
}

/// One of the four arrays.
struct Array {
  std::uint64_t field;  ///< place of its offset in the header
  std::uint64_t offset;
  std::uint64_t size;
  std::uint64_t alignment;
};

std::array<Array, 4> arrays_of(const TrackerRecordHeader& header) {
  const std::uint64_t pixels = std::uint64_t{header.width} * header.height;
  return {{{offsetof(TrackerRecordHeader, features_offset), header.features_offset,
            header.feature_count * sizeof(TrackerFeatureRecord), alignof(TrackerFeatureRecord)},
           {offsetof(TrackerRecordHeader, codes_offset), header.codes_offset,
            std::uint64_t{header.feature_count} * kTrackerCodeBytes, 64},
           {offsetof(TrackerRecordHeader, patches_offset), header.patches_offset,
            header.patch_count * sizeof(TrackerPatchRecord), alignof(TrackerPatchRecord)},
           {offsetof(TrackerRecordHeader, pixels_offset), header.pixels_offset, pixels, 1}}};
}

/// Offset of the first record outside of the image.
template <class Record>
std::optional<TrackerFault> check_places(const TrackerRecordHeader& header,
                                         std::span<const Record> records, std::uint64_t offset,
                                         const char* cause) {
  for (const Record& record : records) {
    if (record.x <= header.width * 64 && record.y <= header.height * 64) continue;
    return TrackerFault{
        offset + static_cast<std::uint64_t>(&record - records.data()) * sizeof record, cause};
  }
  return std::nullopt;
}

std::optional<TrackerFault> check_patch_levels(const TrackerRecordHeader& header,
                                               std::span<const TrackerPatchRecord> patches) {
  std::uint16_t last = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (patches[i].level < last || patches[i].level >= header.level_count) {
      return TrackerFault{header.patches_offset + i * sizeof(TrackerPatchRecord),
                          "a patch's level falls or is not there"};
    }
    last = patches[i].level;
  }
  return std::nullopt;
}

}  // namespace

std::optional<TrackerFault> view_tracker_record(std::span<const std::byte> bytes,
                                                TrackerRecordView& view) {
  if (bytes.size() < sizeof(TrackerRecordHeader)) return TrackerFault{0, "it is cut short"};
  std::memcpy(&view.header, bytes.data(), sizeof view.header);
  const TrackerRecordHeader& header = view.header;
  if (auto fault = check_header(header)) return fault;
  const auto arrays = arrays_of(header);
  for (const Array& array : arrays) {
    if (array.offset % array.alignment != 0)
      return TrackerFault{array.field, "an array is unaligned"};
    if (array.offset < sizeof header || array.offset > bytes.size() ||
        array.size > bytes.size() - array.offset) {
      return TrackerFault{array.field, "an array is outside the section"};
    }
  }
  const auto* base = bytes.data();
  view.features = {reinterpret_cast<const TrackerFeatureRecord*>(base + header.features_offset),
                   header.feature_count};
  // Within the section, so that they fit the address space of 32 bits, too.
  view.codes = {reinterpret_cast<const std::uint8_t*>(base + header.codes_offset),
                static_cast<std::size_t>(arrays[1].size)};
  view.patches = {reinterpret_cast<const TrackerPatchRecord*>(base + header.patches_offset),
                  header.patch_count};
  view.pixels = {reinterpret_cast<const std::uint8_t*>(base + header.pixels_offset),
                 static_cast<std::size_t>(arrays[3].size)};
  if (auto fault = check_places(header, view.features, header.features_offset,
                                "a feature is outside the image")) {
    return fault;
  }
  if (auto fault = check_places(header, view.patches, header.patches_offset,
                                "a patch is outside the image")) {
    return fault;
  }
  return check_patch_levels(header, view.patches);
}

}  // namespace modar
