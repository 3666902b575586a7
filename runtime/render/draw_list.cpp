// Which chunks of which items are drawn, at which level, in which order.
#include "runtime/render/draw_list.hpp"

#include <algorithm>
#include <tuple>

namespace modar {

void DrawList::build(const BundleView& bundle, std::span<const ChunkSetup> setups,
                     const glm::mat4& projection, int height, std::span<const DrawItem> items,
                     float lod_pixels) {
  commands_.clear();
  views_.clear();
  culled_ = 0;
  const Table<LevelRecord> levels = bundle.levels();
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    if (items[i].model >= bundle.models().size()) {
      views_.push_back({});
      continue;
    }
    const ModelRecord& model = bundle.models()[items[i].model];
    views_.push_back(model_view(projection, items[i].to_eye, height));
    const ModelView& view = views_.back();
    for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
      const ChunkRecord& chunk = bundle.chunks()[c];
      const MaterialRecord& material = bundle.materials()[chunk.material];
      const bool two_sided = (material.flags & kMaterialTwoSided) != 0;
      if (outside_frustum(view, chunk) || (!two_sided && faces_away(view, chunk))) {
        ++culled_;
        continue;
      }
      DrawCommand command;
      command.item = i;
      command.chunk = c;
      command.level = chunk.first_level + choose_level(view, chunk, levels, lod_pixels);
      command.program = setups[c].program;
      command.texture = material.texture;
      command.material = setups[c].material;
      // A matrix with a NaN must not upset the order.
      const float distance = eye_distance(view, chunk);
      command.distance = distance >= 0.0f ? distance : 0.0f;
      command.blended = setups[c].blended;
      if (levels[command.level].index_count > 0) commands_.push_back(command);
    }
  }
}

void DrawList::sort_by_distance() {
  std::sort(commands_.begin(), commands_.end(), [](const DrawCommand& a, const DrawCommand& b) {
    return std::tie(a.distance, a.item, a.chunk) < std::tie(b.distance, b.item, b.chunk);
  });
}

void DrawList::sort_by_state(const BundleView& bundle) {
  const Table<LevelRecord> levels = bundle.levels();
  std::sort(commands_.begin(), commands_.end(), [&](const DrawCommand& a, const DrawCommand& b) {
    if (a.blended != b.blended) return b.blended;
    if (a.blended && a.distance != b.distance) return a.distance > b.distance;
    const std::uint64_t a_indices = levels[a.level].index_offset;
    const std::uint64_t b_indices = levels[b.level].index_offset;
    return std::tie(a.program, a.texture, a.material, a.item, a_indices, a.chunk) <
           std::tie(b.program, b.texture, b.material, b.item, b_indices, b.chunk);
  });
}

}  // namespace modar
