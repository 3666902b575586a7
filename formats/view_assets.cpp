// Validation of textures, patterns, parameter sets, features and scenes.
#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/validate.hpp"

namespace modar {
namespace {

/// Above what one wrong step in the largest texture gives.
constexpr double kMaxPsnr = 140.0;

std::uint64_t etc1_bytes(std::uint32_t width, std::uint32_t height) {
  return (std::uint64_t{width} + 3) / 4 * ((std::uint64_t{height} + 3) / 4) * 8;
}

void check_texture(const RecordCheck& check, const TextureRecord& texture) {
  check.name(texture.name);
  check.number(texture.psnr_db, "psnr_db", 0.0, kMaxPsnr);
  check.number(texture.ssim, "ssim", -1.0, 1.0);
  check.flags(texture.flags, kTextureAlpha | kTextureRepeat);
  check.reserved(texture.reserved, sizeof(texture.reserved));
  if (texture.format != static_cast<std::uint32_t>(TextureFormat::kEtc1Rgb)) {
    check.fault(Rule::kEnum, &texture.format,
                "format " + std::to_string(texture.format) + " is not known");
  }
  const std::uint32_t side = std::max(texture.width, texture.height);
  if (std::min(texture.width, texture.height) == 0 || side > kMaxTextureSide ||
      std::min(texture.source_width, texture.source_height) == 0) {
    check.fault(Rule::kTextureRange, &texture.width,
                std::to_string(texture.width) + " x " + std::to_string(texture.height) +
                    " pixels are no possible size");
    return;
  }
  const auto chain = static_cast<std::uint32_t>(std::bit_width(side));
  if (texture.level_count != 1 && texture.level_count != chain) {
    check.fault(Rule::kTextureRange, &texture.level_count,
                std::to_string(texture.level_count) +
                    " levels are neither 1 nor the full chain of " + std::to_string(chain));
  }
}

void check_texture_level(const RecordCheck& check, const TextureRecord& texture,
                         const TextureLevelRecord& level, std::uint32_t number,
                         std::uint64_t data_size) {
  check.number(level.psnr_db, "psnr_db", 0.0, kMaxPsnr);
  check.number(level.ssim, "ssim", -1.0, 1.0);
  check.reserved(&level.reserved, sizeof(level.reserved));
  const std::uint32_t width = std::max(1u, number < 32 ? texture.width >> number : 0u);
  const std::uint32_t height = std::max(1u, number < 32 ? texture.height >> number : 0u);
  if (level.width != width || level.height != height || level.size != etc1_bytes(width, height)) {
    check.fault(Rule::kTextureLevel, &level.size,
                std::to_string(level.width) + " x " + std::to_string(level.height) + " pixels in " +
                    std::to_string(level.size) + " bytes are not " + std::to_string(width) + " x " +
                    std::to_string(height) + " in " + std::to_string(etc1_bytes(width, height)));
  }
  const auto inside = [&](std::uint64_t offset) {
    return offset % 8 == 0 && offset <= data_size && level.size <= data_size - offset;
  };
  const bool alpha = (texture.flags & kTextureAlpha) != 0;
  if (!inside(level.offset) ||
      (alpha ? !inside(level.alpha_offset) : level.alpha_offset != kNoOffset)) {
    check.fault(Rule::kTextureLevel, &level.offset,
                "its blocks at " + std::to_string(level.offset) + " or their alpha twin at " +
                    std::to_string(level.alpha_offset) + " do not lie in the " +
                    std::to_string(data_size) + " bytes of the texture");
  }
}

void check_textures(FaultLog& log, const BundleParts& parts) {
  std::uint64_t next_level = 0;
  for (std::uint32_t i = 0; i < parts.textures.size() && !log.stop(); ++i) {
    const TextureRecord& texture = parts.textures[i];
    const RecordCheck check(log, parts, "texture", i);
    check_texture(check, texture);
    const SectionEntry* data = find_section(parts.sections, SectionType::kTextureData, i, 0);
    const bool found = check.range(Rule::kTextureRange, texture.first_level, texture.level_count,
                                   next_level, parts.texture_levels.size(), "level");
    next_level += texture.level_count;
    for (std::uint32_t j = 0; found && j < texture.level_count && !log.stop(); ++j) {
      const std::uint32_t level = texture.first_level + j;
      check_texture_level(RecordCheck(log, parts, "texture level", level), texture,
                          parts.texture_levels[level], j, data != nullptr ? data->size : 0);
    }
  }
  if (log.clean() && next_level != parts.texture_levels.size()) {
    log.add(
        Rule::kTextureRange, 0, "texture levels",
        std::to_string(parts.texture_levels.size() - next_level) + " levels belong to no texture");
  }
}

void check_pattern(const RecordCheck& check, const PatternRecord& pattern) {
  check.name(pattern.name);
  check.number(pattern.width_mm, "width_mm", 0.0);
  check.number(pattern.score, "score", -1.0, 100.0);
  check.reserved(pattern.reserved, sizeof(pattern.reserved));
  const std::uint32_t side = std::max(pattern.width, pattern.height);
  if (std::min(pattern.width, pattern.height) == 0 || side > kMaxPatternSide) {
    return check.fault(Rule::kPattern, &pattern.width,
                       std::to_string(pattern.width) + " x " + std::to_string(pattern.height) +
                           " pixels are no possible size");
  }
  const double half_width = static_cast<double>(pattern.width) / side;
  const double half_height = static_cast<double>(pattern.height) / side;
  // Written so that NaN fails.
  if (!(std::fabs(static_cast<double>(pattern.half_width) - half_width) <= 1e-6) ||
      !(std::fabs(static_cast<double>(pattern.half_height) - half_height) <= 1e-6)) {
    check.fault(Rule::kPattern, &pattern.half_width,
                "half sides " + number_text(static_cast<double>(pattern.half_width)) + ", " +
                    number_text(static_cast<double>(pattern.half_height)) +
                    " do not follow from its pixels");
  }
}

void check_parameter_set(const RecordCheck& check, const BundleParts& parts, std::uint32_t index) {
  const ParameterSetRecord& set = parts.parameter_sets[index];
  check.name(set.name);
  check.number(set.scale_factor, "scale_factor", 0.0);
  check.number(set.pattern_scale, "pattern_scale", 0.0);
  check.number(set.ransac_threshold, "ransac_threshold", 0.0);
  check.reserved(set.reserved, sizeof(set.reserved));
  if (set.detector != static_cast<std::uint32_t>(Detector::kFastOrb) &&
      set.detector != static_cast<std::uint32_t>(Detector::kAgastBrisk)) {
    check.fault(Rule::kEnum, &set.detector,
                "detector " + std::to_string(set.detector) + " is not known");
  }
  if (set.harris > 1) {
    check.fault(Rule::kEnum, &set.harris, "harris is " + std::to_string(set.harris));
  }
  if (index > 0 && parts.parameter_sets[index - 1].id >= set.id) {
    check.fault(Rule::kParameterSet, &set.id, "ids do not rise from set to set");
  }
  if (set.descriptor_bits == 0 || set.descriptor_bits % 8 != 0 ||
      set.descriptor_bits > kMaxDescriptorBits) {
    check.fault(Rule::kParameterSet, &set.descriptor_bits,
                std::to_string(set.descriptor_bits) + " bits are no possible descriptor");
  }
}

void check_twin(const RecordCheck& check, const BundleParts& parts, const SectionEntry& entry,
                const ParameterSetRecord& set) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  if (bytes.size() < sizeof(FeatureHeader)) {
    return check.fault(Rule::kFeatures, &entry.size, "it is too small for its header");
  }
  const auto& header = *reinterpret_cast<const FeatureHeader*>(bytes.data());
  check.reserved(&header.reserved, sizeof(header.reserved));
  const std::uint64_t keypoint_bytes = std::uint64_t{header.count} * sizeof(KeypointRecord);
  const std::uint64_t descriptor_bytes = std::uint64_t{header.count} * header.descriptor_bytes;
  const std::uint64_t first = header.keypoints_offset;
  const std::uint64_t second = header.descriptors_offset;
  if (header.descriptor_bytes != set.descriptor_bits / 8) {
    check.fault(Rule::kFeatures, &header.descriptor_bytes,
                "descriptors of " + std::to_string(header.descriptor_bytes) +
                    " bytes are not the " + std::to_string(set.descriptor_bits) +
                    " bits of its parameter set");
  }
  if (first != sizeof(FeatureHeader) || second % 16 != 0 || second > bytes.size() ||
      second < first + keypoint_bytes || second - first - keypoint_bytes >= 16 ||
      descriptor_bytes != bytes.size() - second) {
    check.fault(Rule::kFeatures, &header.keypoints_offset,
                std::to_string(header.count) + " keypoints at " + std::to_string(first) +
                    " and descriptors at " + std::to_string(second) + " do not fill its " +
                    std::to_string(bytes.size()) + " bytes");
  }
}

/// Sections that belong to a record: the record is there, and so is the parameter set.
void check_owned_sections(FaultLog& log, const BundleParts& parts) {
  for (std::uint32_t i = 0; i < parts.sections.size() && !log.stop(); ++i) {
    const SectionEntry& entry = parts.sections[i];
    const RecordCheck check(log, parts, "section", i);
    const auto type = static_cast<SectionType>(entry.type);
    if (type == SectionType::kTextureData) {
      if (entry.owner >= parts.textures.size() || entry.variant != 0) {
        check.fault(Rule::kSectionOwner, &entry.owner,
                    "texture " + std::to_string(entry.owner) + " is not there");
      }
    } else if (type == SectionType::kMappedFeatures || type == SectionType::kFeatureYml) {
      const std::uint32_t set = find_parameter_set(parts.parameter_sets, entry.variant);
      if (entry.owner >= parts.patterns.size() || set == kNone) {
        check.fault(Rule::kSectionOwner, &entry.owner,
                    "pattern " + std::to_string(entry.owner) + " or parameter set " +
                        std::to_string(entry.variant) + " is not there");
      } else if (type == SectionType::kMappedFeatures) {
        check_twin(check, parts, entry, parts.parameter_sets[set]);
      }
    } else if (type == SectionType::kTrackerRecord) {
      if (entry.owner >= parts.patterns.size() || entry.variant != 0) {
        check.fault(Rule::kSectionOwner, &entry.owner,
                    "pattern " + std::to_string(entry.owner) + " is not there");
      }
    }
  }
}

void check_scene(const RecordCheck& check, const BundleParts& parts, const SceneRecord& scene) {
  check.number(scene.scale, "scale", std::numeric_limits<float>::denorm_min());
  check.numbers(scene.offset, "offset");
  check.numbers(scene.rotation, "rotation");
  check.reserved(scene.reserved, sizeof(scene.reserved));
  if (scene.pattern >= parts.patterns.size() || scene.model >= parts.models.size()) {
    check.fault(Rule::kScene, &scene.pattern,
                "pattern " + std::to_string(scene.pattern) + " or model " +
                    std::to_string(scene.model) + " is not there");
  }
  double square = 0.0;
  for (const float part : scene.rotation) {
    square += static_cast<double>(part) * static_cast<double>(part);
  }
  if (!(std::fabs(square - 1.0) <= 1e-4)) {
    check.fault(Rule::kScene, scene.rotation, "its rotation is no unit quaternion");
  }
}

}  // namespace

std::uint32_t find_parameter_set(const Table<ParameterSetRecord>& sets, std::uint32_t id) {
  std::uint32_t low = 0;
  std::uint32_t high = sets.size();
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (sets[middle].id < id) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low < sets.size() && sets[low].id == id ? low : kNone;
}

void validate_assets(FaultLog& log, const BundleParts& parts) {
  check_textures(log, parts);
  for (std::uint32_t i = 0; i < parts.patterns.size() && !log.stop(); ++i) {
    check_pattern(RecordCheck(log, parts, "pattern", i), parts.patterns[i]);
  }
  for (std::uint32_t i = 0; i < parts.parameter_sets.size() && !log.stop(); ++i) {
    check_parameter_set(RecordCheck(log, parts, "parameter set", i), parts, i);
  }
  if (!log.stop()) check_owned_sections(log, parts);
  for (std::uint32_t i = 0; i < parts.scenes.size() && !log.stop(); ++i) {
    check_scene(RecordCheck(log, parts, "scene", i), parts, parts.scenes[i]);
  }
}

}  // namespace modar
