// How many triangles culling sends, against those whose own boxes meet the frustum.
#include "runtime/bench/cull_bench.hpp"

#include <algorithm>
#include <cstring>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>

#include "formats/quantise.hpp"
#include "modar/camera.hpp"
#include "runtime/render/cull.hpp"

namespace modar {
namespace {

float component(const std::byte* bytes, const AttributeRecord& attribute, std::uint32_t index) {
  switch (static_cast<ComponentType>(attribute.type)) {
    case ComponentType::kHalf: {
      std::uint16_t half = 0;
      std::memcpy(&half, bytes + 2 * index, sizeof half);
      return half_to_float(half);
    }
    case ComponentType::kI16: {
      std::int16_t value = 0;
      std::memcpy(&value, bytes + 2 * index, sizeof value);
      return attribute.normalised != 0 ? std::max(static_cast<float>(value) / 32767.0f, -1.0f)
                                       : static_cast<float>(value);
    }
    case ComponentType::kU16: {
      std::uint16_t value = 0;
      std::memcpy(&value, bytes + 2 * index, sizeof value);
      return attribute.normalised != 0 ? unorm16_to_float(value) : static_cast<float>(value);
    }
    case ComponentType::kF32: {
      float value = 0;
      std::memcpy(&value, bytes + 4 * index, sizeof value);
      return value;
    }
    case ComponentType::kI8:
    case ComponentType::kU8:
      break;
  }
  return 0.0f;
}

AttributeRecord position_of(const LayoutRecord& layout) {
  for (const AttributeRecord& attribute : layout.attributes) {
    if (static_cast<Semantic>(attribute.semantic) == Semantic::kPosition) return attribute;
  }
  return layout.attributes[0];
}

/// Boxes of the triangles of a chunk's level 0, as chunks of their own.
std::vector<ChunkRecord> triangle_boxes(const BundleView& bundle, const LayoutRecord& layout,
                                        const ChunkRecord& chunk) {
  const LevelRecord& level = bundle.levels()[chunk.first_level];
  const AttributeRecord position = position_of(layout);
  std::vector<ChunkRecord> boxes(level.index_count / 3);
  for (std::uint32_t i = 0; i < level.index_count; ++i) {
    std::uint16_t index = 0;
    std::memcpy(&index, bundle.indices().data() + level.index_offset + 2 * std::uint64_t{i},
                sizeof index);
    if (index >= level.vertex_count) continue;
    const std::byte* vertex = bundle.vertices().data() + level.vertex_offset +
                              std::uint64_t{index} * layout.stride + position.offset;
    ChunkRecord& box = boxes[i / 3];
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const float value =
          chunk.position_offset[axis] + chunk.position_step * component(vertex, position, axis);
      box.bounds_min[axis] = i % 3 == 0 ? value : std::min(box.bounds_min[axis], value);
      box.bounds_max[axis] = i % 3 == 0 ? value : std::max(box.bounds_max[axis], value);
    }
  }
  return boxes;
}

std::vector<ModelView> views_from_inside() {
  std::vector<ModelView> views;
  const Camera camera = default_camera(480, 800);
  const glm::mat4 projection = gl_projection(camera, 0.01, 10.0);
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const int axes = x * x + y * y + z * z;
        if (axes != 1 && axes != 3) continue;
        const glm::vec3 up = x == 0 && y == 0 ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 1);
        views.push_back(model_view(projection, glm::lookAt(glm::vec3(0.0f), glm::vec3(x, y, z), up),
                                   camera.height));
      }
    }
  }
  return views;
}

}  // namespace

CullCounts count_culling(const BundleView& bundle, std::uint32_t model) {
  const std::vector<ModelView> views = views_from_inside();
  const ModelRecord& record = bundle.models()[model];
  CullCounts counts;
  for (std::uint32_t c = record.first_chunk; c < record.first_chunk + record.chunk_count; ++c) {
    const ChunkRecord& chunk = bundle.chunks()[c];
    const std::vector<ChunkRecord> boxes =
        triangle_boxes(bundle, bundle.layouts()[record.layout], chunk);
    for (const ModelView& view : views) {
      if (!outside_frustum(view, chunk)) counts.sent += boxes.size();
      counts.needed += static_cast<std::uint64_t>(std::ranges::count_if(
          boxes, [&](const ChunkRecord& box) { return !outside_frustum(view, box); }));
    }
  }
  return counts;
}

}  // namespace modar
