// The rules on sections, records, textures and patterns, and the order in which all rules run.
#include "formats/check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "formats/base/bits.hpp"
#include "formats/check_rules.hpp"
#include "formats/draw_order.hpp"
#include "formats/meta_text.hpp"
#include "formats/texture_format.hpp"
#include "formats/tracker_record.hpp"
#include "formats/validate.hpp"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace modar {
namespace {

/// Bytes that are hashed between two releases.
constexpr std::uint64_t kReleaseStep = 1u << 20;

void check_zero(FaultLog& log, std::span<const std::byte> bytes, std::uint64_t first,
                std::uint64_t end, const std::string& where) {
  const auto gap =
      bytes.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(end - first));
  // All bytes are zero if the first one is and each equals the one before it.
  if (gap.empty() ||
      (gap[0] == std::byte{0} && std::memcmp(gap.data(), gap.data() + 1, gap.size() - 1) == 0)) {
    return;
  }
  const auto found =
      std::find_if(gap.begin(), gap.end(), [](std::byte b) { return b != std::byte{0}; });
  log.add(Rule::kPadding, first + static_cast<std::uint64_t>(found - gap.begin()), where,
          "a byte of padding is not zero");
}

void check_meta(FaultLog& log, const BundleParts& parts, const SectionEntry& entry) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  const auto fault = check_meta_text({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (fault) log.add(Rule::kMetaText, entry.offset + fault->offset, "meta", fault->cause);
}

}  // namespace

struct SectionHash::State {
  XXH64_state_t xxh;
};

SectionHash::SectionHash(FaultLog& log, const BundleParts& parts, const CheckOptions& options,
                         const SectionEntry* entry)
    : log_(log), parts_(parts), options_(options), entry_(entry), state_(new State) {
  XXH64_reset(&state_->xxh, 0);
}

SectionHash::~SectionHash() = default;

void SectionHash::read_to(std::uint64_t end) {
  if (entry_ == nullptr) return;
  const std::span<const std::byte> bytes = section_bytes(parts_, *entry_);
  while (hashed_ < end) {
    const std::uint64_t step = std::min(end - hashed_, kReleaseStep);
    XXH64_update(&state_->xxh, bytes.data() + hashed_, static_cast<std::size_t>(step));
    hashed_ += step;
    if (hashed_ - released_ >= kReleaseStep) release(false);
  }
}

void SectionHash::finish() {
  if (entry_ == nullptr) return;
  read_to(entry_->size);
  // Small sections stay: the next checks read them.
  if (released_ > 0) release(true);
  if (XXH64_digest(&state_->xxh) == entry_->hash) return;
  log_.add(Rule::kSectionHash, entry_->offset,
           "section " + std::to_string(entry_ - parts_.sections.data()),
           "the hash of its {} bytes of type {} differs from the stated one",
           {entry_->size, entry_->type});
}

/// Gives back whole pages; the last one may hold the start of the next range.
void SectionHash::release(bool all) {
  const std::uint64_t end = all ? hashed_ : hashed_ / kGpuAlignment * kGpuAlignment;
  if (options_.release && end > released_) {
    options_.release(section_bytes(parts_, *entry_)
                         .subspan(static_cast<std::size_t>(released_),
                                  static_cast<std::size_t>(end - released_)));
  }
  released_ = end;
}

namespace {

/// Hashes of sections other than vertices and indices, zero padding between them, sections that are
/// skipped.
void check_section_bytes(FaultLog& log, const BundleParts& parts, const CheckOptions& options) {
  const auto great = [&parts](SectionType type) {
    return find_section(parts.sections, type, kNone, 0);
  };
  std::uint64_t end = sizeof(FileHeader) + parts.sections.size_bytes();
  for (std::uint32_t i = 0; i < parts.sections.size(); ++i) {
    const SectionEntry& entry = parts.sections[i];
    const std::string where = with_numbers("section {}", {i});
    check_zero(log, parts.bytes, end, entry.offset, "before " + where);
    end = entry.offset + entry.size;
    if (&entry != great(SectionType::kVertices) && &entry != great(SectionType::kIndices)) {
      SectionHash(log, parts, options, &entry).finish();
    }
    if (entry.type == static_cast<std::uint32_t>(SectionType::kMeta)) check_meta(log, parts, entry);
    if (!known_section_type(entry.type) && (entry.flags & kSectionRequired) == 0) {
      log.add(Rule::kUnknownSection, entry.offset, where, "type {}, {} bytes",
              {entry.type, entry.size});
    }
  }
}

double wide(float value) {
  return static_cast<double>(value);
}

void check_counts(FaultLog& log, const BundleParts& parts, const ModelRecord& model) {
  std::uint64_t triangles = 0;
  std::uint64_t vertices = 0;
  std::uint32_t levels = 0;
  for (std::uint32_t i = 0; i < model.chunk_count; ++i) {
    const ChunkRecord& chunk = parts.chunks[model.first_chunk + i];
    const LevelRecord& finest = parts.levels[chunk.first_level];
    triangles += finest.index_count / 3;
    vertices += finest.vertex_count;
    levels = std::max(levels, chunk.level_count);
  }
  if (model.triangle_count != triangles || model.vertex_count > vertices ||
      model.level_count != levels) {
    log.add(
        Rule::kModelCounts, offset_of(parts, &model.vertex_count),
        label(parts, "model", model.name),
        "it states {} vertices, {} triangles, {} levels; its chunks have at most {}, exactly {} "
        "and {}",
        {model.vertex_count, model.triangle_count, model.level_count, vertices, triangles, levels});
  }
}

/// The diagonal of the box of all chunks, and how much of it may be errors: packed positions are up
/// to one off the source's, coarser levels up to theirs off level 0. Both in source units.
std::pair<double, double> decoded_diagonal(const BundleParts& parts, const ModelRecord& model) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::array<double, 3> low = {kFar, kFar, kFar};
  std::array<double, 3> high = {-kFar, -kFar, -kFar};
  double coarsest = 0.0;
  for (std::uint32_t i = 0; i < model.chunk_count; ++i) {
    const ChunkRecord& chunk = parts.chunks[model.first_chunk + i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], wide(chunk.bounds_min[axis]));
      high[axis] = std::max(high[axis], wide(chunk.bounds_max[axis]));
    }
    const LevelRecord& last = parts.levels[chunk.first_level + chunk.level_count - 1];
    coarsest = std::max(coarsest, wide(last.error));
  }
  if (model.chunk_count == 0) return {0.0, 0.0};
  const double diagonal =
      model.scale * std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  // Each end of each side may be off.
  return {diagonal, 2.0 * std::sqrt(3.0) * (model.position_error_max + model.scale * coarsest)};
}

/// A box whose largest side is 2 s has a diagonal between 2 s and 2 s sqrt(3).
void check_placement(FaultLog& log, const BundleParts& parts, const ModelRecord& model) {
  constexpr double kRounding = 1e-6;
  const double side = 2.0 * model.scale;
  const auto [decoded, slack] = decoded_diagonal(parts, model);
  const bool point = model.diagonal == 0.0 && model.scale == 1.0;
  const bool box = model.diagonal >= side * (1.0 - kRounding) &&
                   model.diagonal <= side * std::sqrt(3.0) * (1.0 + kRounding);
  if ((point || box) && decoded <= model.diagonal * (1.0 + kRounding) + slack) return;
  log.add(Rule::kModelPlacement, offset_of(parts, &model.scale), label(parts, "model", model.name),
          "its largest side is " + number_text(side) + ", its diagonal " +
              number_text(model.diagonal) + ", that of its chunks " + number_text(decoded));
}

void check_errors(FaultLog& log, const BundleParts& parts, const ModelRecord& model) {
  constexpr double kRounding = 1.0 + 1e-6;
  if (model.position_error_rms <= model.position_error_max * kRounding &&
      wide(model.normal_error_rms_deg) <= wide(model.normal_error_max_deg) * kRounding &&
      wide(model.uv_error_rms_texels) <= wide(model.uv_error_max_texels) * kRounding) {
    return;
  }
  log.add(Rule::kModelErrors, offset_of(parts, &model.position_error_max),
          label(parts, "model", model.name),
          "means and greatest: positions " + number_text(model.position_error_rms) + " and " +
              number_text(model.position_error_max) + ", normals " +
              number_text(wide(model.normal_error_rms_deg)) + " and " +
              number_text(wide(model.normal_error_max_deg)) + " degrees, uvs " +
              number_text(wide(model.uv_error_rms_texels)) + " and " +
              number_text(wide(model.uv_error_max_texels)) + " texels");
}

void check_chunk(FaultLog& log, const BundleParts& parts, const ChunkRecord& chunk,
                 const std::string& where) {
  constexpr double kLimit = 1.0 + 0x1p-10;
  double square = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (wide(chunk.bounds_min[axis]) < -kLimit || wide(chunk.bounds_max[axis]) > kLimit) {
      log.add(Rule::kChunkOutside, offset_of(parts, &chunk), where,
              "its box reaches from " + number_text(wide(chunk.bounds_min[axis])) + " to " +
                  number_text(wide(chunk.bounds_max[axis])));
    }
    square += wide(chunk.cone_axis[axis]) * wide(chunk.cone_axis[axis]);
  }
  const double length = std::sqrt(square);
  const bool unit = std::fabs(length - 1.0) <= 1e-3;
  const bool never = length == 0.0 && chunk.cone_cutoff > 1.0f;
  if (chunk.cone_cutoff < 0.0f || !(unit || never)) {
    log.add(Rule::kChunkCone, offset_of(parts, chunk.cone_axis), where,
            "the axis has length " + number_text(length) + ", the cut-off is " +
                number_text(wide(chunk.cone_cutoff)));
  }
}

bool has_integer_positions(const LayoutRecord& layout) {
  for (std::uint32_t i = 0; i < layout.attribute_count; ++i) {
    const AttributeRecord& a = layout.attributes[i];
    if (a.semantic != static_cast<std::uint8_t>(Semantic::kPosition)) continue;
    return a.type != static_cast<std::uint8_t>(ComponentType::kHalf) &&
           a.type != static_cast<std::uint8_t>(ComponentType::kF32) && a.normalised == 0;
  }
  return false;
}

/// Is a chunk on the grid of the first chunk of its group?
void check_grid(FaultLog& log, const BundleParts& parts, const ChunkGroup& group,
                const ChunkRecord& chunk, const std::string& where) {
  if (!has_integer_positions(parts.layouts[parts.models[group.model].layout])) return;
  const float step = chunk.position_step;
  int exponent = 0;
  bool good =
      step == parts.chunks[group.first_chunk].position_step && std::frexp(step, &exponent) == 0.5f;
  for (const float offset : chunk.position_offset) good = good && std::fmod(offset, step) == 0.0f;
  if (good) return;
  log.add(Rule::kChunkGrid, offset_of(parts, chunk.position_offset), where,
          "step " + number_text(wide(step)) + ", offset " +
              number_text(wide(chunk.position_offset[0])) + " " +
              number_text(wide(chunk.position_offset[1])) + " " +
              number_text(wide(chunk.position_offset[2])));
}

void check_levels(FaultLog& log, const BundleParts& parts, const ChunkRecord& chunk,
                  const std::string& where) {
  for (std::uint32_t i = 0; i < chunk.level_count; ++i) {
    const LevelRecord& level = parts.levels[chunk.first_level + i];
    const LevelRecord& finer = parts.levels[chunk.first_level + (i > 0 ? i - 1 : 0)];
    const std::string at = where + ", level " + std::to_string(i);
    if (i == 0 ? level.error != 0.0f
               : level.error < finer.error || level.index_count > finer.index_count) {
      log.add(Rule::kLevelOrder, offset_of(parts, &level), at,
              "error " + number_text(wide(level.error)) + " and " +
                  std::to_string(level.index_count) + " indices do not follow " +
                  (i == 0 ? "the source"
                          : number_text(wide(finer.error)) + " and " +
                                std::to_string(finer.index_count)));
    }
    if (level.index_count == 0) {
      log.add(Rule::kEmptyLevel, offset_of(parts, &level), at, "it has no indices");
    }
  }
}

void check_material(FaultLog& log, const BundleParts& parts, const MaterialRecord& material) {
  bool usable = material.shininess >= 0.0f && material.opacity >= 0.0f && material.opacity <= 1.0f;
  for (const auto* colour :
       {&material.ambient, &material.diffuse, &material.specular, &material.emission}) {
    for (const float channel : *colour) usable = usable && channel >= 0.0f;
  }
  if (usable) return;
  log.add(Rule::kMaterialValues, offset_of(parts, &material),
          label(parts, "material", material.name),
          "a channel or the shininess is negative, or the opacity " +
              number_text(wide(material.opacity)) + " is not from 0 to 1");
}

/// Looks for the first byte of a buffer that no range of a level covers. Levels are mostly in
/// order, so that few passes over the table do; after that it gives the buffer the benefit of the
/// doubt.
template <class RangeOf>
void check_referenced(FaultLog& log, const BundleParts& parts, Rule rule,
                      std::span<const std::byte> buffer, RangeOf range_of) {
  constexpr int kPasses = 16;
  std::uint64_t covered = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::uint64_t before = covered;
    for (std::uint32_t i = 0; i < parts.levels.size(); ++i) {
      const auto [first, size] = range_of(i);
      // Three bytes and fewer align what follows.
      if (first <= (covered + 3) / 4 * 4) covered = std::max(covered, first + size);
    }
    if (covered + 3 >= buffer.size()) return;
    if (covered == before) {
      log.add(rule, offset_of(parts, buffer.data()) + covered, "buffer",
              "no level refers to byte {} of {}", {covered, buffer.size()});
      return;
    }
  }
}

/// Strides by level would need a table; levels of a model are adjacent, so a cursor suffices.
class StrideCursor {
 public:
  explicit StrideCursor(const BundleParts& parts) : parts_(parts) {}
  /// Levels are requested in rising order, then from 0 again.
  std::uint32_t operator()(std::uint32_t level) {
    if (level == 0) group_ = end_ = 0;
    while (level >= end_ && group_ < parts_.chunk_groups()) {
      const ChunkGroup group = parts_.chunk_group(group_++);
      stride_ = parts_.layouts[parts_.models[group.model].layout].stride;
      if (group.chunk_count == 0) continue;
      const ChunkRecord& last = parts_.chunks[group.first_chunk + group.chunk_count - 1];
      end_ = last.first_level + last.level_count;
    }
    return stride_;
  }

 private:
  const BundleParts& parts_;
  std::uint32_t group_ = 0;
  std::uint32_t end_ = 0;
  std::uint32_t stride_ = 0;
};

/// From fine to coarse.
void check_proxy_order(FaultLog& log, const BundleParts& parts, std::uint32_t group) {
  const ChunkGroup finer = parts.chunk_group(group - 1);
  const ChunkGroup coarser = parts.chunk_group(group);
  if (finer.model != coarser.model) return;
  const auto level = [&](const ChunkGroup& of, std::uint32_t c) -> const LevelRecord& {
    return parts.levels[parts.chunks[of.first_chunk + c].first_level];
  };
  const auto indices = [&](const ChunkGroup& of) {
    std::uint64_t count = 0;
    for (std::uint32_t c = 0; c < of.chunk_count; ++c) count += level(of, c).index_count;
    return count;
  };
  if (level(finer, 0).error <= level(coarser, 0).error && indices(finer) >= indices(coarser)) {
    return;
  }
  log.add(Rule::kLevelOrder, offset_of(parts, &level(coarser, 0)), group_label(parts, group),
          "error " + number_text(wide(level(coarser, 0).error)) + " and " +
              std::to_string(indices(coarser)) + " indices do not follow " +
              number_text(wide(level(finer, 0).error)) + " and " + std::to_string(indices(finer)));
}

void check_model_records(FaultLog& log, const BundleParts& parts) {
  for (const MaterialRecord& material : parts.materials) check_material(log, parts, material);
  for (const ModelRecord& model : parts.models) {
    check_placement(log, parts, model);
    check_errors(log, parts, model);
    check_counts(log, parts, model);
  }
  for (std::uint32_t i = 0; i < parts.chunk_groups(); ++i) {
    const ChunkGroup group = parts.chunk_group(i);
    for (std::uint32_t j = 0; j < group.chunk_count; ++j) {
      const ChunkRecord& chunk = parts.chunks[group.first_chunk + j];
      const std::string where = group_label(parts, i) + ", chunk " + std::to_string(j);
      check_chunk(log, parts, chunk, where);
      check_grid(log, parts, group, chunk, where);
      if (i < parts.models.size()) check_levels(log, parts, chunk, where);
    }
    if (i > parts.models.size()) check_proxy_order(log, parts, i);
  }
  StrideCursor stride(parts);
  check_referenced(log, parts, Rule::kUnreferencedVertices, parts.vertices, [&](std::uint32_t i) {
    const LevelRecord& level = parts.levels[i];
    return std::pair(level.vertex_offset, std::uint64_t{level.vertex_count} * stride(i));
  });
  check_referenced(log, parts, Rule::kUnreferencedIndices, parts.indices, [&](std::uint32_t i) {
    const LevelRecord& level = parts.levels[i];
    return std::pair(level.index_offset, std::uint64_t{level.index_count} * 2);
  });
  if (parts.models.empty() && parts.patterns.empty()) {
    log.add(Rule::kNoContent, 0, "bundle", "there is no model and no pattern");
  }
}

struct Range {
  std::uint64_t first = 0;
  std::uint64_t end = 0;
};

void check_sides(FaultLog& log, const BundleParts& parts, const TextureRecord& texture) {
  const bool powers = is_power_of_two(texture.width) && is_power_of_two(texture.height);
  if (powers || (texture.level_count == 1 && (texture.flags & kTextureRepeat) == 0)) return;
  log.add(Rule::kTextureSides, offset_of(parts, &texture.width),
          label(parts, "texture", texture.name), "{} x {} pixels, {} levels, flags {}",
          {texture.width, texture.height, texture.level_count, texture.flags});
}

void check_blocks(FaultLog& log, const BundleParts& parts, const TextureRecord& texture,
                  const SectionEntry& data) {
  // A side has at most 14 levels, and each has at most a twin.
  std::array<Range, 2 * bit_width(kMaxTextureSide)> ranges;
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
              "a level starts at byte {}, before byte {} where another ends",
              {range->first, covered});
    } else if (range->first > covered) {
      log.add(Rule::kTextureUnreferenced, data.offset + covered, where,
              "{} bytes belong to no level", {range->first - covered});
    }
    covered = std::max(covered, range->end);
  }
  if (covered < data.size) {
    log.add(Rule::kTextureUnreferenced, data.offset + covered, where, "{} bytes belong to no level",
            {data.size - covered});
  }
}

void check_texture_blocks(FaultLog& log, const BundleParts& parts) {
  for (std::uint32_t i = 0; i < parts.textures.size(); ++i) {
    const TextureRecord& texture = parts.textures[i];
    check_sides(log, parts, texture);
    // A texture has at least one level, and a clean structure has bytes for it.
    const SectionEntry& data = *find_section(parts.sections, SectionType::kTextureData, i, 0);
    check_blocks(log, parts, texture, data);
  }
}

bool is_orb(const ParameterSetRecord& set) {
  return set.detector == static_cast<std::uint32_t>(Detector::kFastOrb);
}

/// What the device's detectors take, too: a set that they refuse is not to travel.
bool can_run(const ParameterSetRecord& set) {
  const bool common = set.min_matches >= 4 && set.min_inliers >= 4 && set.ransac_threshold > 0.0f &&
                      set.max_distance > 0 && set.max_distance <= set.descriptor_bits;
  if (is_orb(set)) {
    return common && set.max_features >= 1 && set.max_features <= 100000 &&
           set.scale_factor > 1.0f && set.scale_factor <= 4.0f && set.level_count >= 1 &&
           set.level_count <= 16 && set.edge_threshold <= 1024 &&
           set.first_level < set.level_count && set.wta_k >= 2 && set.wta_k <= 4 &&
           set.patch_size >= 2 && set.patch_size <= 255 && set.fast_threshold >= 1 &&
           set.fast_threshold <= 255 && set.agast_threshold == 0 && set.octaves == 0 &&
           set.pattern_scale == 0.0f;
  }
  return common && set.agast_threshold >= 1 && set.agast_threshold <= 255 && set.octaves <= 8 &&
         set.pattern_scale >= 0.1f && set.pattern_scale <= 10.0f && set.max_features == 0 &&
         set.scale_factor == 0.0f && set.level_count == 0 && set.edge_threshold == 0 &&
         set.first_level == 0 && set.wta_k == 0 && set.harris == 0 && set.patch_size == 0 &&
         set.fast_threshold == 0;
}

void check_parameter_set(FaultLog& log, const BundleParts& parts, const ParameterSetRecord& set) {
  const std::uint32_t bits = is_orb(set) ? 256 : 512;
  if (set.descriptor_bits != bits) {
    log.add(Rule::kDescriptorLength, offset_of(parts, &set.descriptor_bits),
            label(parts, "parameter set", set.name), "{} bits, the detector makes {}",
            {set.descriptor_bits, bits});
  }
  if (!can_run(set)) {
    log.add(Rule::kParameterValues, offset_of(parts, &set), label(parts, "parameter set", set.name),
            "see PARAMETER_VALUES in bundle.md");
  }
}

void check_twin(FaultLog& log, const BundleParts& parts, const ParameterSetRecord& set,
                const SectionEntry& entry, const std::string& where) {
  const PatternRecord& pattern = parts.patterns[entry.owner];
  constexpr std::uint32_t kAny = 1u << 31;
  const std::uint32_t octaves = is_orb(set) ? set.level_count : kAny;
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  const auto& header = *reinterpret_cast<const FeatureHeader*>(bytes.data());
  const std::span keypoints(
      reinterpret_cast<const KeypointRecord*>(bytes.data() + header.keypoints_offset),
      header.count);
  Tally values;
  Tally outside;
  for (const KeypointRecord& k : keypoints) {
    // Comparisons are written so that NaN fails.
    if (!(k.size > 0.0f && std::isfinite(k.size) && std::fabs(k.angle) <= 360.0f &&
          std::isfinite(k.response) && static_cast<std::uint32_t>(k.octave) < octaves &&
          std::isfinite(k.x) && std::isfinite(k.y))) {
      values.hit(offset_of(parts, &k));
    } else if (!(k.x >= 0.0f && k.y >= 0.0f &&
                 static_cast<double>(k.x) <= static_cast<double>(pattern.width) &&
                 static_cast<double>(k.y) <= static_cast<double>(pattern.height))) {
      outside.hit(offset_of(parts, &k));
    }
  }
  const auto tell = [&](Rule rule, const Tally& tally) {
    if (tally.count == 0) return;
    log.add(rule, tally.first, where, "{} keypoints", {tally.count});
  };
  tell(Rule::kKeypointValues, values);
  tell(Rule::kKeypointOutside, outside);
  const std::uint64_t end = header.keypoints_offset + keypoints.size_bytes();
  for (std::uint64_t i = end; i < header.descriptors_offset; ++i) {
    if (bytes[static_cast<std::size_t>(i)] == std::byte{0}) continue;
    log.add(Rule::kPadding, entry.offset + i, where,
            "a byte between keypoints and descriptors is not zero");
    break;
  }
}

void check_text(FaultLog& log, const BundleParts& parts, const SectionEntry& entry,
                const std::string& where) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!text.starts_with("%YAML:1.0")) {
    log.add(Rule::kFeatureYml, entry.offset, where, "it does not start with %YAML:1.0");
  }
  if (find_section(parts.sections, SectionType::kMappedFeatures, entry.owner, entry.variant) ==
      nullptr) {
    log.add(Rule::kFeatureYml, entry.offset, where, "it has no mapped twin");
  }
}

void check_tracker_record(FaultLog& log, const BundleParts& parts, const PatternRecord& pattern,
                          const SectionEntry& entry) {
  const std::string where = label(parts, "pattern", pattern.name) + ", tracker record";
  TrackerRecordView view;
  if (const auto fault = view_tracker_record(section_bytes(parts, entry), view)) {
    log.add(Rule::kTrackerRecord, entry.offset + fault->offset, where, fault->cause);
  } else if (view.header.describer_version != kTrackerExtractorVersion) {
    log.add(Rule::kTrackerRecord, entry.offset, where, "its describer's version is unknown");
  } else if (view.header.width != pattern.width || view.header.height != pattern.height) {
    log.add(Rule::kTrackerRecord, entry.offset + offsetof(TrackerRecordHeader, width), where,
            "its image has another size than the pattern");
  }
}

/// Only its frame: a RIFF file states its size in bytes 4 to 7, without the first eight.
void check_picture(FaultLog& log, const BundleParts& parts, const PatternRecord& pattern,
                   const SectionEntry& entry) {
  const std::span<const std::byte> bytes = section_bytes(parts, entry);
  std::uint32_t size = 0;
  const bool framed = bytes.size() > 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
                      std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
  if (framed) std::memcpy(&size, bytes.data() + 4, sizeof size);
  if (framed && bytes.size() <= kMaxPatternPicture && bytes.size() == std::size_t{size} + 8) return;
  log.add(Rule::kPattern, entry.offset, label(parts, "pattern", pattern.name),
          "its picture is not a WebP file of at most {} bytes", {kMaxPatternPicture});
}

/// The twins of a pattern are adjacent in the section table.
void check_findable(FaultLog& log, const BundleParts& parts, std::uint32_t index) {
  if (find_section(parts.sections, SectionType::kTrackerRecord, index, 0) != nullptr) return;
  constexpr auto kTwin = static_cast<std::uint32_t>(SectionType::kMappedFeatures);
  const auto first =
      std::lower_bound(parts.sections.begin(), parts.sections.end(), index,
                       [](const SectionEntry& entry, std::uint32_t owner) {
                         return entry.type < kTwin || (entry.type == kTwin && entry.owner < owner);
                       });
  for (auto entry = first;
       entry != parts.sections.end() && entry->type == kTwin && entry->owner == index; ++entry) {
    const auto& header =
        *reinterpret_cast<const FeatureHeader*>(section_bytes(parts, *entry).data());
    const std::uint32_t set = find_parameter_set(parts.parameter_sets, entry->variant);
    if (header.count >= parts.parameter_sets[set].min_matches) return;
  }
  const PatternRecord& pattern = parts.patterns[index];
  log.add(Rule::kFeaturesMissing, offset_of(parts, &pattern), label(parts, "pattern", pattern.name),
          "it has no tracker record, and no parameter set found as many features as it "
          "wants matches");
}

void check_patterns(FaultLog& log, const BundleParts& parts) {
  for (const ParameterSetRecord& set : parts.parameter_sets) check_parameter_set(log, parts, set);
  for (std::uint32_t i = 0; i < parts.patterns.size(); ++i) check_findable(log, parts, i);
  for (const SectionEntry& entry : parts.sections) {
    const auto type = static_cast<SectionType>(entry.type);
    if (type == SectionType::kTrackerRecord) {
      check_tracker_record(log, parts, parts.patterns[entry.owner], entry);
    }
    if (type == SectionType::kPatternPicture) {
      check_picture(log, parts, parts.patterns[entry.owner], entry);
    }
    if (type != SectionType::kMappedFeatures && type != SectionType::kFeatureYml) continue;
    const PatternRecord& pattern = parts.patterns[entry.owner];
    const std::uint32_t set = find_parameter_set(parts.parameter_sets, entry.variant);
    const std::string where = label(parts, "pattern", pattern.name) + ", " +
                              label(parts, "parameter set", parts.parameter_sets[set].name);
    if (type == SectionType::kMappedFeatures) {
      check_twin(log, parts, parts.parameter_sets[set], entry, where);
    } else {
      check_text(log, parts, entry, where);
    }
  }
}

/// Subtrees end inside of those that they belong to, and each triangle is in one node.
bool is_tree(std::span<const DrawOrderRecord> nodes, std::size_t triangles) {
  std::vector<bool> seen(triangles);
  std::vector<std::size_t> ends = {nodes.size()};  // of the subtrees around the node
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const DrawOrderRecord& node = nodes[i];
    while (ends.back() == i) ends.pop_back();
    if (node.behind > ends.back() - i - 1) return false;
    if (node.behind > 0) ends.push_back(i + 1 + node.behind);
    if (node.triangle == kNone) continue;
    if (node.triangle >= triangles || seen[node.triangle]) return false;
    seen[node.triangle] = true;
  }
  return std::find(seen.begin(), seen.end(), false) == seen.end();
}

void check_draw_orders(FaultLog& log, const BundleParts& parts) {
  for (const SectionEntry& entry : parts.sections) {
    if (static_cast<SectionType>(entry.type) != SectionType::kDrawOrder) continue;
    const std::span<const std::byte> bytes = section_bytes(parts, entry);
    const auto* first = reinterpret_cast<const DrawOrderRecord*>(bytes.data());
    const LevelRecord& level = parts.levels[parts.chunks[entry.owner].first_level];
    if (is_tree({first, bytes.size() / sizeof *first}, level.index_count / 3)) continue;
    log.add(Rule::kChunkRange, entry.offset, with_numbers("chunk {}", {entry.owner}),
            "its draw order is not a tree that holds each triangle once");
  }
}

/// The stated minor version has all that the bundle uses, and is one that this program knows.
void check_minor(FaultLog& log, const BundleParts& parts, bool accept_newer) {
  const auto& header = *reinterpret_cast<const FileHeader*>(parts.bytes.data());
  std::uint16_t needed = 0;
  for (const SectionEntry& entry : parts.sections) {
    needed = std::max(needed, section_since(entry.type));
  }
  for (const MaterialRecord& material : parts.materials) {
    needed = std::max(needed, flags_since("MaterialRecord", material.flags));
  }
  for (const TextureRecord& texture : parts.textures) {
    needed = std::max(needed, flags_since("TextureRecord", texture.flags));
  }
  for (const PatternRecord& pattern : parts.patterns) {
    if (pattern.copies > 0) needed = std::max<std::uint16_t>(needed, 4);
  }
  const std::string states = with_numbers("it states 1.{}, ", {header.minor});
  if (header.minor < needed) {
    log.add(Rule::kMinor, offsetof(FileHeader, minor), "header",
            states + "and uses what 1." + std::to_string(needed) + " added");
  } else if (header.minor > kMinorVersion && !accept_newer) {
    log.add(Rule::kMinor, offsetof(FileHeader, minor), "header",
            states + "this program knows up to 1." + std::to_string(kMinorVersion) +
                " and cannot judge what that added");
  }
}

/// Models that no scene shows, and patterns on which nothing stands, where there are both.
void check_shown(FaultLog& log, const BundleParts& parts) {
  if (parts.models.empty() || parts.patterns.empty()) return;
  std::vector<bool> models(parts.models.size());
  std::vector<bool> patterns(parts.patterns.size());
  for (const SceneRecord& scene : parts.scenes) {
    models[scene.model] = patterns[scene.pattern] = true;
  }
  for (const NodeRecord& node : parts.nodes) patterns[node.pattern] = true;
  for (std::uint32_t i = 0; i < models.size(); ++i) {
    const ModelRecord& model = parts.models[i];
    if (models[i]) continue;
    log.add(Rule::kNeverShown, offset_of(parts, &model), label(parts, "model", model.name),
            "no pattern shows it");
  }
  for (std::uint32_t i = 0; i < patterns.size(); ++i) {
    const PatternRecord& pattern = parts.patterns[i];
    if (patterns[i]) continue;
    log.add(Rule::kNeverShown, offset_of(parts, &pattern), label(parts, "pattern", pattern.name),
            "nothing is on it");
  }
}

/// Everything but sections as bytes.
void check_contents(FaultLog& log, BundleParts& parts, BufferHashes& hashes, bool accept_newer) {
  const std::uint64_t damaged = log.errors();
  if (!validate_tables(log, parts)) return;
  validate_models(log, parts);
  validate_assets(log, parts);
  // Payloads are read through records, so these have to be clean; a wrong hash does no harm.
  if (log.errors() != damaged) return;
  check_minor(log, parts, accept_newer);
  check_model_records(log, parts);
  check_summary(log, parts);
  check_geometry(log, parts, hashes);
  check_texture_blocks(log, parts);
  check_patterns(log, parts);
  check_draw_orders(log, parts);
  check_node_texts(log, parts);
  check_media_files(log, parts);
  check_shown(log, parts);
}

}  // namespace

void check_shown(const BundleView& bundle, const IssueSink& sink) {
  FaultLog log(sink);
  check_shown(log, bundle.parts());
}

bool check_bundle(std::span<const std::byte> bytes, const IssueSink& sink,
                  const CheckOptions& options) {
  FaultLog log(sink);
  BundleParts parts;
  if (!validate_sections(bytes, log, parts)) return false;
  check_section_bytes(log, parts, options);
  const auto section = [&parts](SectionType type) {
    return find_section(parts.sections, type, kNone, 0);
  };
  BufferHashes hashes{{log, parts, options, section(SectionType::kVertices)},
                      {log, parts, options, section(SectionType::kIndices)}};
  check_contents(log, parts, hashes, options.accept_newer);
  hashes.vertices.finish();
  hashes.indices.finish();
  return log.clean();
}

std::string first_error(std::span<const std::byte> bytes, const CheckOptions& options) {
  std::string error;
  const IssueSink sink = [&error](const Issue& issue) {
    if (issue.kind->severity != Severity::kError || !error.empty()) return;
    error = std::string(issue.kind->id) + " " + issue.where;
  };
  check_bundle(bytes, sink, options);
  return error;
}

}  // namespace modar
