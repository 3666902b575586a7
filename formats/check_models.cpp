// Rules on the records of models, chunks, levels and materials.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "formats/check_rules.hpp"
#include "formats/validate.hpp"

namespace modar {
namespace {

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
    log.add(Rule::kModelCounts, offset_of(parts, &model.vertex_count),
            label(parts, "model", model.name),
            "it states " + std::to_string(model.vertex_count) + " vertices, " +
                std::to_string(model.triangle_count) + " triangles, " +
                std::to_string(model.level_count) + " levels; its chunks have at most " +
                std::to_string(vertices) + ", exactly " + std::to_string(triangles) + " and " +
                std::to_string(levels));
  }
}

/// The diagonal of the box of all chunks, and how much of it may be errors: packed positions lie up
/// to one beside the source's, coarser levels up to theirs beside level 0. Both in source units.
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

/// Does a chunk stand on the grid that the first chunk of its model has?
void check_grid(FaultLog& log, const BundleParts& parts, const ModelRecord& model,
                const ChunkRecord& chunk, const std::string& where) {
  if (!has_integer_positions(parts.layouts[model.layout])) return;
  const float step = chunk.position_step;
  int exponent = 0;
  bool good =
      step == parts.chunks[model.first_chunk].position_step && std::frexp(step, &exponent) == 0.5f;
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

/// Looks for the first byte of a buffer that no range of a level covers. Levels mostly lie in
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
              "no level refers to byte " + std::to_string(covered) + " of " +
                  std::to_string(buffer.size()));
      return;
    }
  }
}

/// Strides by level would need a table; levels of a model lie together, so a cursor does.
class StrideCursor {
 public:
  explicit StrideCursor(const BundleParts& parts) : parts_(parts) {}
  /// Levels are asked for in rising order, then from 0 again.
  std::uint32_t operator()(std::uint32_t level) {
    if (level == 0) model_ = end_ = 0;
    while (level >= end_ && model_ < parts_.models.size()) {
      const ModelRecord& model = parts_.models[model_++];
      stride_ = parts_.layouts[model.layout].stride;
      if (model.chunk_count == 0) continue;
      const ChunkRecord& last = parts_.chunks[model.first_chunk + model.chunk_count - 1];
      end_ = last.first_level + last.level_count;
    }
    return stride_;
  }

 private:
  const BundleParts& parts_;
  std::uint32_t model_ = 0;
  std::uint32_t end_ = 0;
  std::uint32_t stride_ = 0;
};

}  // namespace

void check_model_records(FaultLog& log, const BundleParts& parts) {
  for (std::uint32_t i = 0; i < parts.materials.size(); ++i) {
    check_material(log, parts, parts.materials[i]);
  }
  for (std::uint32_t i = 0; i < parts.models.size(); ++i) {
    const ModelRecord& model = parts.models[i];
    check_placement(log, parts, model);
    check_errors(log, parts, model);
    check_counts(log, parts, model);
    for (std::uint32_t j = 0; j < model.chunk_count; ++j) {
      const ChunkRecord& chunk = parts.chunks[model.first_chunk + j];
      const std::string where = label(parts, "model", model.name) + ", chunk " + std::to_string(j);
      check_chunk(log, parts, chunk, where);
      check_grid(log, parts, model, chunk, where);
      check_levels(log, parts, chunk, where);
    }
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

}  // namespace modar
