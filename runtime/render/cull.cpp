// What a view shows of a box.
#include "runtime/render/cull.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar {
namespace {

/// Slack for rounding, relative to the size of what is compared.
constexpr float kSlack = 1e-5f;

glm::vec3 corner(const ChunkRecord& chunk, unsigned which) {
  return {(which & 1) != 0 ? chunk.bounds_max[0] : chunk.bounds_min[0],
          (which & 2) != 0 ? chunk.bounds_max[1] : chunk.bounds_min[1],
          (which & 4) != 0 ? chunk.bounds_max[2] : chunk.bounds_min[2]};
}

}  // namespace

ModelView model_view(const glm::mat4& projection, const glm::mat4& to_eye, int height) {
  ModelView view;
  const glm::dmat4 clip = glm::transpose(glm::dmat4(projection) * glm::dmat4(to_eye));
  // A row of the transposed matrix is a clip coordinate as a function of the point.
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t i = static_cast<std::size_t>(axis) * 2;
    view.planes[i] = glm::vec4(clip[3] + clip[axis]);
    view.planes[i + 1] = glm::vec4(clip[3] - clip[axis]);
  }
  const glm::dmat3 linear(to_eye);
  view.eye = glm::vec3(-(glm::inverse(linear) * glm::dvec3(to_eye[3])));
  view.perspective = std::abs(projection[2][3]) > 0.0f;
  view.mirrored = glm::determinant(linear) < 0.0;
  view.scale = static_cast<float>(
      std::sqrt(std::max({glm::dot(linear[0], linear[0]), glm::dot(linear[1], linear[1]),
                          glm::dot(linear[2], linear[2])})));
  view.pixels = 0.5f * static_cast<float>(height) * std::abs(projection[1][1]);
  return view;
}

bool outside_frustum(const ModelView& view, const ChunkRecord& chunk) {
  for (const glm::vec4& plane : view.planes) {
    float reach = plane.w;
    float size = std::abs(plane.w);
    for (int axis = 0; axis < 3; ++axis) {
      const float far_side = plane[axis] >= 0.0f ? chunk.bounds_max[axis] : chunk.bounds_min[axis];
      reach += plane[axis] * far_side;
      size += std::abs(plane[axis] * far_side);
    }
    if (reach < -kSlack * size) return true;
  }
  return false;
}

bool faces_away(const ModelView& view, const ChunkRecord& chunk) {
  // For cutoffs in [0, 1], the directions that see only backs are a convex cone: a box whose eight
  // corners lie in it lies in it as a whole.
  if (!view.perspective || !(chunk.cone_cutoff >= 0.0f) || chunk.cone_cutoff > 1.0f) return false;
  const glm::vec3 axis(chunk.cone_axis[0], chunk.cone_axis[1], chunk.cone_axis[2]);
  for (unsigned i = 0; i < 8; ++i) {
    const glm::vec3 ray = corner(chunk, i) - view.eye;
    const float length = glm::length(ray);
    if (glm::dot(ray, axis) < (chunk.cone_cutoff + kSlack) * length || length == 0.0f) return false;
  }
  return true;
}

float eye_distance(const ModelView& view, const ChunkRecord& chunk) {
  if (!view.perspective) return 0.0f;
  glm::vec3 gap(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    gap[axis] = std::max(
        {chunk.bounds_min[axis] - view.eye[axis], view.eye[axis] - chunk.bounds_max[axis], 0.0f});
  }
  return glm::length(gap) * view.scale;
}

std::uint32_t choose_level(const ModelView& view, const ChunkRecord& chunk,
                           const Table<LevelRecord>& levels, float pixels) {
  // With parallel rays, one unit has the same size at every distance.
  const float distance = view.perspective ? eye_distance(view, chunk) : 1.0f;
  std::uint32_t level = 0;
  while (level + 1 < chunk.level_count &&
         levels[chunk.first_level + level + 1].error * view.scale * view.pixels <=
             pixels * distance) {
    ++level;
  }
  return level;
}

}  // namespace modar
