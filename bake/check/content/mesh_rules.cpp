// Meshes: what a writer derived from the vertices and triangles that a bundle holds.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/check/content/content_rules.hpp"
#include "bake/mesh/pack/chunk.hpp"
#include "bake/mesh/pack/vertex_codec.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"
#include "formats/base/parallel.hpp"
#include "formats/base/ranges.hpp"
#include "formats/component.hpp"
#include "formats/transport/chunk_order.hpp"

namespace modar {
namespace {

/// Of cones, which are sums of f64 rounded to f32.
constexpr float kConeSlack = 1e-6f;
/// Of stated figures, which are rounded to f32.
constexpr double kFigureRounding = 1.0 + 1e-6;

/// The bytes that a chunk alone uses: of chunks that share a range of vertices, a part of it.
struct ChunkPart {
  const ChunkRecord* chunk = nullptr;
  std::vector<std::vector<std::uint16_t>> levels;  ///< indices into the part
  std::span<const std::byte> vertices;
  std::vector<std::size_t> group_ends;  ///< vertices, from the front, that coarser levels keep
};

ChunkPart part_of(const BundleView& bundle, const ChunkRecord& chunk, std::size_t stride) {
  ChunkPart part;
  part.chunk = &chunk;
  std::uint16_t low = 0xFFFF;
  std::uint16_t high = 0;
  const Table<LevelRecord> levels = bundle.levels();
  for (std::uint32_t l = 0; l < chunk.level_count; ++l) {
    const LevelRecord& level = levels[chunk.first_level + l];
    const auto* first =
        reinterpret_cast<const std::uint16_t*>(bundle.indices().data() + level.index_offset);
    part.levels.emplace_back(first, first + level.index_count);
    for (const std::uint16_t index : part.levels.back()) {
      low = std::min(low, index);
      high = std::max(high, index);
    }
    part.group_ends.push_back(level.vertex_count);
  }
  if (low > high) return part;
  for (auto& level : part.levels) {
    for (std::uint16_t& index : level) index = static_cast<std::uint16_t>(index - low);
  }
  part.vertices = bundle.vertices().subspan(
      static_cast<std::size_t>(levels[chunk.first_level].vertex_offset) + low * stride,
      (std::size_t{high} - low + 1) * stride);
  return part;
}

/// Is the part in the order that its content gives it? See ChunkOrderer.
bool in_order(const ChunkPart& part, std::size_t stride) {
  ChunkOrderer orderer;
  std::vector<std::uint16_t> ordered = part.levels[0];
  const auto order = orderer.order(part.vertices, static_cast<std::uint32_t>(stride), ordered);
  if (order.size() * stride != part.vertices.size()) return false;  // two vertices are alike
  std::vector<std::uint16_t> place(order.size());
  for (std::size_t v = 0; v < order.size(); ++v) place[order[v]] = static_cast<std::uint16_t>(v);
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    if (place[part.levels[0][i]] != ordered[i]) return false;
  }
  for (std::size_t v = 1; v < place.size(); ++v) {
    if (place[v] < place[v - 1] && ranges::count(part.group_ends, v) == 0) return false;
  }
  LevelOrderer level_orderer;
  for (std::size_t l = 1; l < part.levels.size(); ++l) {
    ordered = part.levels[l];
    level_orderer.order(ordered, static_cast<std::uint32_t>(place.size()));
    if (ordered != part.levels[l]) return false;
  }
  return true;
}

bool has_its_bounds(const ChunkPart& part, const VertexDecoder& decoder) {
  std::vector<glm::vec3> positions;
  for (std::size_t at = 0; at < part.vertices.size(); at += decoder.stride()) {
    positions.emplace_back(decoder.position(part.vertices.data() + at, *part.chunk));
  }
  std::vector<std::uint16_t> all;
  for (const auto& level : part.levels) all.insert(all.end(), level.begin(), level.end());
  const ChunkBounds bounds = chunk_bounds(positions, all);
  const ChunkRecord& chunk = *part.chunk;
  // 2: never culled.
  bool same =
      bounds.cone_cutoff == chunk.cone_cutoff ||
      (bounds.cone_cutoff <= 1 && std::fabs(bounds.cone_cutoff - chunk.cone_cutoff) <= kConeSlack);
  for (int i = 0; i < 3; ++i) {
    same = same && std::fabs(bounds.cone_axis[i] - chunk.cone_axis[i]) <= kConeSlack &&
           bounds.low[i] == chunk.bounds_min[i] && bounds.high[i] == chunk.bounds_max[i];
  }
  return same;
}

/// Offset 0 and scale 1, or a range beyond [0,1] from the least coordinate to the greatest, of a
/// texture that repeats.
bool has_its_uv_range(const BundleView& bundle, const ChunkPart& part, const LayoutRecord& layout) {
  const AttributeRecord* uv = find_attribute(layout, Semantic::kUv);
  const std::uint32_t texture = bundle.materials()[part.chunk->material].texture;
  const bool repeats = texture == kNone || (bundle.textures()[texture].flags & kTextureRepeat) != 0;
  for (std::size_t i = 0; i < 2; ++i) {
    if (part.chunk->uv_offset[i] == 0.0f && part.chunk->uv_scale[i] == 1.0f) continue;
    const double end = static_cast<double>(part.chunk->uv_offset[i]) +
                       static_cast<double>(part.chunk->uv_scale[i]);
    if (uv == nullptr || !repeats || (part.chunk->uv_offset[i] >= 0.0f && end <= 1.0)) return false;
    double low = 1;
    double high = 0;
    for (std::size_t at = 0; at < part.vertices.size(); at += layout.stride) {
      const double value =
          decode_component(*uv, part.vertices.data() + at, static_cast<std::uint32_t>(i));
      low = std::min(low, value);
      high = std::max(high, value);
    }
    if (low > 1e-4 || (high < 1 - 1e-4 && high > 0)) return false;
  }
  return true;
}

/// Halves and floats are the model's space itself.
bool has_its_grid(const ChunkRecord& chunk, const LayoutRecord& layout) {
  const auto type = static_cast<ComponentType>(find_attribute(layout, Semantic::kPosition)->type);
  if (type != ComponentType::kHalf && type != ComponentType::kF32) return true;
  return chunk.position_step == 1.0f && chunk.position_offset[0] == 0.0f &&
         chunk.position_offset[1] == 0.0f && chunk.position_offset[2] == 0.0f;
}

const char* chunk_fault(const BundleView& bundle, const ChunkPart& part,
                        const LayoutRecord& layout) {
  if (part.vertices.empty()) return nullptr;
  if (!in_order(part, layout.stride)) {
    return "its triangles or vertices are not in the order that their bytes give";
  }
  if (!has_its_bounds(part, VertexDecoder(layout))) {
    return "its box or its normal cone is not that of its triangles";
  }
  if (!has_its_uv_range(bundle, part, layout)) {
    return "its texture coordinates do not fill their range, or the texture does not repeat";
  }
  if (!has_its_grid(*part.chunk, layout)) return "its positions have an offset or a step";
  return nullptr;
}

/// What rounding can make of a model's figures at most: model space, degrees, texels.
struct FigureBounds {
  double position = 0;
  double normal = 0;
  double uv = 0;
};

FigureBounds bounds_of(const BundleView& bundle, const ModelRecord& model) {
  const LayoutRecord& layout = bundle.layouts()[model.layout];
  const auto type = static_cast<ComponentType>(find_attribute(layout, Semantic::kPosition)->type);
  const double share = type == ComponentType::kHalf  ? 0x1p-12
                       : type == ComponentType::kF32 ? 0x1p-25
                                                     : 0.5;  // of a step
  FigureBounds bounds;
  // Of three bytes 0.58 degrees, octahedral ones 1.32.
  bounds.normal = find_attribute(layout, Semantic::kNormalOct) != nullptr ? 1.5 : 0.7;
  for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[c];
    bounds.position = std::max(bounds.position,
                               std::sqrt(3.0) * share * static_cast<double>(chunk.position_step));
    const MaterialRecord& material = bundle.materials()[chunk.material];
    if (material.texture == kNone) continue;
    const TextureRecord& texture = bundle.textures()[material.texture];
    const double step = static_cast<double>(std::max(chunk.uv_scale[0], chunk.uv_scale[1])) / 65535;
    bounds.uv = std::max(bounds.uv, std::max(texture.width, texture.height) * step);
  }
  return bounds;
}

const char* figure_fault(const BundleView& bundle, const ModelRecord& model) {
  const FigureBounds bounds = bounds_of(bundle, model);
  if (model.position_error_max > bounds.position * model.scale * kFigureRounding ||
      static_cast<double>(model.normal_error_max_deg) > bounds.normal ||
      static_cast<double>(model.uv_error_max_texels) > bounds.uv) {
    return "an error is more than rounding gives";
  }
  std::map<std::uint64_t, std::uint32_t> ranges;
  for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[c];
    const LevelRecord& level = bundle.levels()[chunk.first_level];
    std::uint32_t& count = ranges[level.vertex_offset];
    count = std::max(count, level.vertex_count);
  }
  std::uint64_t vertices = 0;
  for (const auto& [offset, count] : ranges) vertices += count;
  if (vertices != model.vertex_count) return "its vertex count is not that of its chunks";
  constexpr std::uint64_t kMostSource = 0xFFFFFFFF;
  if (model.source_vertex_count > kMostSource || model.source_face_count > kMostSource) {
    return "no source has as many vertices or faces";
  }
  return nullptr;
}

void check_group(ContentLog& log, std::uint32_t index) {
  const BundleView& bundle = log.bundle;
  const ChunkGroup group = bundle.chunk_group(index);
  const ModelRecord& model = bundle.models()[group.model];
  const LayoutRecord& layout = bundle.layouts()[model.layout];
  std::vector<const char*> faults(group.chunk_count);
  parallel_rows(group.chunk_count, log.options.jobs, [&](std::uint32_t c) {
    const ChunkPart part = part_of(bundle, bundle.chunks()[group.first_chunk + c], layout.stride);
    faults[c] = chunk_fault(bundle, part, layout);
  });
  const std::string where = log.label("model", model.name);
  for (std::uint32_t c = 0; c < group.chunk_count; ++c) {
    if (faults[c] == nullptr) continue;
    const std::uint32_t chunk = group.first_chunk + c;
    log.tell(WorkstationRule::kChunkContent, where + ", chunk " + std::to_string(chunk),
             &bundle.chunks()[chunk], faults[c]);
  }
  if (index >= bundle.models().size()) return;
  const char* fault = figure_fault(bundle, model);
  if (fault != nullptr) log.tell(WorkstationRule::kModelFigures, where, &model, fault);
}

}  // namespace

void check_meshes(ContentLog& log) {
  for (std::uint32_t g = 0; g < log.bundle.chunk_groups() && !log.done(); ++g) check_group(log, g);
}

}  // namespace modar
