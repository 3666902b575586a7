// Rules on textures: what OpenGL ES 2.0 can sample, and blocks that nobody or two levels own.
#include <algorithm>
#include <array>
#include <bit>

#include "formats/check_rules.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

struct Range {
  std::uint64_t first = 0;
  std::uint64_t end = 0;
};

void check_sides(FaultLog& log, const BundleParts& parts, const TextureRecord& texture) {
  const bool powers = std::has_single_bit(texture.width) && std::has_single_bit(texture.height);
  if (powers || (texture.level_count == 1 && (texture.flags & kTextureRepeat) == 0)) return;
  log.add(
      Rule::kTextureSides, offset_of(parts, &texture.width), label(parts, "texture", texture.name),
      std::to_string(texture.width) + " x " + std::to_string(texture.height) + " pixels, " +
          std::to_string(texture.level_count) + " levels, flags " + std::to_string(texture.flags));
}

void check_blocks(FaultLog& log, const BundleParts& parts, const TextureRecord& texture,
                  const SectionEntry& data) {
  // A side has at most 14 levels, and each has at most a twin.
  std::array<Range, 2 * std::bit_width(kMaxTextureSide)> ranges;
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < texture.level_count; ++i) {
    const TextureLevelRecord& level = parts.texture_levels[texture.first_level + i];
    ranges[count++] = {level.offset, level.offset + level.size};
    if (level.alpha_offset != kNoOffset) {
      ranges[count++] = {level.alpha_offset, level.alpha_offset + level.size};
    }
  }
  const auto end = ranges.begin() + static_cast<std::ptrdiff_t>(count);
  std::sort(ranges.begin(), end, [](Range a, Range b) { return a.first < b.first; });
  std::uint64_t covered = 0;
  const std::string where = label(parts, "texture", texture.name);
  for (auto range = ranges.begin(); range != end; ++range) {
    if (range->first < covered) {
      log.add(Rule::kTextureOverlap, data.offset + range->first, where,
              "a level starts at byte " + std::to_string(range->first) + ", before byte " +
                  std::to_string(covered) + " where another ends");
    } else if (range->first > covered) {
      log.add(Rule::kTextureUnreferenced, data.offset + covered, where,
              std::to_string(range->first - covered) + " bytes belong to no level");
    }
    covered = std::max(covered, range->end);
  }
  if (covered < data.size) {
    log.add(Rule::kTextureUnreferenced, data.offset + covered, where,
            std::to_string(data.size - covered) + " bytes belong to no level");
  }
}

}  // namespace

void check_textures(FaultLog& log, const BundleParts& parts, StatementCheck& statement) {
  for (std::uint32_t i = 0; i < parts.textures.size(); ++i) {
    const TextureRecord& texture = parts.textures[i];
    check_sides(log, parts, texture);
    // A texture has at least one level, and a clean structure has bytes for it.
    const SectionEntry& data = *find_section(parts.sections, SectionType::kTextureData, i, 0);
    check_blocks(log, parts, texture, data);
    for (std::uint32_t j = 0; j < texture.level_count; ++j) {
      statement.texture_level(texture.first_level + j, section_bytes(parts, data));
    }
  }
}

}  // namespace modar
