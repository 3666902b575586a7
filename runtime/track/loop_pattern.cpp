// Checks a loop record and hands out its arrays.
#include "loop_pattern.hpp"

#include <algorithm>

#include "modar/loop_features.hpp"

namespace modar::loop {
namespace {

constexpr std::uint32_t kLargestSide = 1023;

tl::unexpected<Error> bad(const char* cause) {
  return fail(ExitCode::kInvalidInput, "tracker.record", "", cause, "bake the pattern again");
}

/// The bytes of `count` records at `offset`, or nullptr where they do not lie in the section.
const std::byte* array_at(std::span<const std::byte> bytes, std::uint64_t offset,
                          std::uint64_t count, std::uint64_t size, std::uint64_t alignment) {
  if (offset > bytes.size() || offset % alignment != 0) return nullptr;
  if (count > (bytes.size() - offset) / size) return nullptr;
  return bytes.data() + offset;
}

bool sane(const LoopRecordHeader& header) {
  return header.width >= 1 && header.width <= kLargestSide && header.height >= 1 &&
         header.height <= kLargestSide && header.level_count >= 1 &&
         header.level_count <= kMaxLoopImageLevels && header.feature_count <= kMaxLoopFeatures &&
         header.feature_count % kLoopBlockCodes == 0 &&
         header.bright_count % kLoopBlockCodes == 0 &&
         header.bright_count <= header.feature_count && header.patch_count <= kMaxLoopPatches;
}

bool inside(const LoopRecordHeader& header, std::uint16_t x, std::uint16_t y) {
  return x <= header.width * 64 && y <= header.height * 64;
}

bool view_levels(const LoopRecordHeader& header, std::span<const std::byte> bytes,
                 LoopPattern& out) {
  std::uint64_t offset = header.pixels_offset;
  std::uint32_t width = header.width;
  std::uint32_t height = header.height;
  for (std::uint32_t level = 0; level < header.level_count; ++level, width /= 2, height /= 2) {
    const std::byte* pixels = array_at(bytes, offset, std::uint64_t{width} * height, 1, 1);
    if (width == 0 || height == 0 || pixels == nullptr) return false;
    out.levels[level] = {reinterpret_cast<const std::uint8_t*>(pixels), static_cast<int>(width),
                         static_cast<int>(height), static_cast<std::ptrdiff_t>(width)};
    offset += std::uint64_t{width} * height;
  }
  out.level_count = static_cast<int>(header.level_count);
  return true;
}

bool view_patches(const LoopRecordHeader& header, std::span<const LoopPatchRecord> all,
                  LoopPattern& out) {
  std::size_t first = 0;
  for (std::uint32_t level = 0; level < header.level_count; ++level) {
    std::size_t last = first;
    while (last < all.size() && all[last].level == level) {
      if (!inside(header, all[last].x, all[last].y)) return false;
      ++last;
    }
    out.patches[level] = all.subspan(first, last - first);
    first = last;
  }
  return first == all.size();
}

}  // namespace

glm::dvec2 LoopPattern::to_world(glm::dvec2 pixel) const {
  const double longest = std::max(width(), height());
  return {(2.0 * pixel.x + 1.0 - width()) / longest, (height() - 2.0 * pixel.y - 1.0) / longest};
}

glm::dmat3 LoopPattern::world_from_pixels() const {
  const double longest = std::max(width(), height());
  glm::dmat3 m(1.0);
  m[0][0] = 2.0 / longest;
  m[1][1] = -2.0 / longest;
  m[2] = {(1.0 - width()) / longest, (height() - 1.0) / longest, 1.0};
  return m;
}

Result<LoopPattern> view_loop_record(std::span<const std::byte> bytes, std::uint32_t index) {
  if (bytes.size() < sizeof(LoopRecordHeader)) return bad("the pattern's loop record is cut short");
  const auto& header = *reinterpret_cast<const LoopRecordHeader*>(bytes.data());
  if (header.describer_version != kLoopDescriberVersion) {
    return fail(ExitCode::kUnsupported, "tracker.record-version", "",
                "the pattern's loop record is of another version", "bake the pattern again");
  }
  if (!sane(header)) return bad("the pattern's loop record has a wild count");
  const std::byte* features = array_at(bytes, header.features_offset, header.feature_count,
                                       sizeof(LoopFeatureRecord), alignof(LoopFeatureRecord));
  const std::byte* codes =
      array_at(bytes, header.codes_offset, header.feature_count, kLoopCodeBytes, 64);
  const std::byte* patches = array_at(bytes, header.patches_offset, header.patch_count,
                                      sizeof(LoopPatchRecord), alignof(LoopPatchRecord));
  LoopPattern out;
  if (features == nullptr || codes == nullptr || patches == nullptr ||
      !view_levels(header, bytes, out)) {
    return bad("the pattern's loop record points outside of itself");
  }
  out.index = index;
  out.bright_count = header.bright_count;
  out.features = {reinterpret_cast<const LoopFeatureRecord*>(features), header.feature_count};
  out.codes = reinterpret_cast<const std::uint8_t*>(codes);
  const auto outside = [&](const auto& record) { return !inside(header, record.x, record.y); };
  if (std::any_of(out.features.begin(), out.features.end(), outside) ||
      !view_patches(header, {reinterpret_cast<const LoopPatchRecord*>(patches), header.patch_count},
                    out)) {
    return bad("the pattern's loop record has a feature or patch outside of its picture");
  }
  return out;
}

}  // namespace modar::loop
