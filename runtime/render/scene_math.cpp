// Where a scene's model stands on its pattern, and how deep a view has to be.
#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "modar/renderer.hpp"

namespace modar {
namespace {

struct Depths {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = -std::numeric_limits<double>::infinity();
};

/// Depth in front of the eye is -z; over a box it spans its centre's, plus or minus its reach.
void add_box(const glm::dmat4& to_eye, const ChunkRecord& chunk, Depths& depths) {
  double centre = -to_eye[3][2];
  double reach = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = static_cast<double>(chunk.bounds_min[axis]);
    const double high = static_cast<double>(chunk.bounds_max[axis]);
    centre -= to_eye[axis][2] * 0.5 * (low + high);
    reach += std::abs(to_eye[axis][2]) * 0.5 * (high - low);
  }
  depths.nearest = std::min(depths.nearest, centre - reach);
  depths.farthest = std::max(depths.farthest, centre + reach);
}

}  // namespace

glm::mat4 scene_matrix(const SceneRecord& scene) {
  const glm::quat rotation(scene.rotation[3], scene.rotation[0], scene.rotation[1],
                           scene.rotation[2]);
  glm::mat4 matrix = glm::mat4_cast(glm::normalize(rotation));
  // Decoded models and patterns both have a largest side of 2: the default placement scales by 1.
  for (int axis = 0; axis < 3; ++axis) matrix[axis] *= scene.scale;
  matrix[3] = glm::vec4(scene.offset[0], scene.offset[1], scene.offset[2], 1.0f);
  return matrix;
}

DepthRange depth_range(const BundleView& bundle, std::span<const DrawItem> items) {
  // A ratio beyond this leaves a 16-bit depth buffer too few steps at the far end.
  constexpr double kGreatestRatio = 1000.0;
  constexpr double kMargin = 0.01;
  Depths depths;
  for (const DrawItem& item : items) {
    if (item.model >= bundle.models().size()) continue;
    const ModelRecord& model = bundle.models()[item.model];
    const glm::dmat4 to_eye(item.to_eye);
    for (std::uint32_t c = 0; c < model.chunk_count; ++c) {
      add_box(to_eye, bundle.chunks()[model.first_chunk + c], depths);
    }
  }
  if (!(depths.farthest > 0.0) || !std::isfinite(depths.farthest)) return {};
  DepthRange range;
  range.far_plane = depths.farthest * (1.0 + kMargin);
  range.near_plane = std::max(depths.nearest * (1.0 - kMargin), range.far_plane / kGreatestRatio);
  return range;
}

}  // namespace modar
