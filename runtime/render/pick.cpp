// A ray against the triangles of a bundle: which model is under a pixel.
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_inverse.hpp>
#include <glm/matrix.hpp>

#include "formats/component.hpp"
#include "modar/renderer.hpp"
#include "runtime/render/draw_list.hpp"

namespace modar {
namespace {

struct Ray {
  glm::dvec3 from;
  glm::dvec3 step;
};

/// Slabs: whether the ray meets the box before `limit` steps.
bool meets_box(const Ray& ray, const ChunkRecord& chunk, double limit) {
  double enter = 0.0;
  double leave = limit;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = static_cast<double>(chunk.bounds_min[axis]) - ray.from[axis];
    const double high = static_cast<double>(chunk.bounds_max[axis]) - ray.from[axis];
    if (ray.step[axis] == 0.0) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    const double a = low / ray.step[axis];
    const double b = high / ray.step[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

/// Moeller & Trumbore, "Fast, minimum storage ray-triangle intersection" (1997): steps to the
/// triangle, or infinity.
double meet_triangle(const Ray& ray, const std::array<glm::dvec3, 3>& corners) {
  constexpr double kMiss = std::numeric_limits<double>::infinity();
  const glm::dvec3 first = corners[1] - corners[0];
  const glm::dvec3 second = corners[2] - corners[0];
  const glm::dvec3 p = glm::cross(ray.step, second);
  const double determinant = glm::dot(first, p);
  if (determinant == 0.0) return kMiss;
  const glm::dvec3 offset = ray.from - corners[0];
  const double u = glm::dot(offset, p) / determinant;
  const glm::dvec3 q = glm::cross(offset, first);
  const double v = glm::dot(ray.step, q) / determinant;
  if (!(u >= 0.0) || !(v >= 0.0) || !(u + v <= 1.0)) return kMiss;
  const double steps = glm::dot(second, q) / determinant;
  return steps > 0.0 ? steps : kMiss;
}

/// Steps to the square [-1, 1] of the plane z = 0, or `nearest`.
double meet_square(const Ray& ray, double nearest) {
  const double steps = -ray.from.z / ray.step.z;
  const glm::dvec3 at = ray.from + steps * ray.step;
  const bool met = std::fabs(at.x) <= 1.0 && std::fabs(at.y) <= 1.0 && steps > 0.0;
  return met ? std::min(nearest, steps) : nearest;
}

/// A vertex of the rest pose where bones turn it; without attributes, the first one turns all.
glm::dvec3 turned(const LayoutRecord& layout, const std::byte* vertex, const PartRecord& part,
                  const BoneMatrix* bones, glm::dvec3 rest) {
  const AttributeRecord* joints = find_attribute(layout, Semantic::kJoints);
  const AttributeRecord* weights = find_attribute(layout, Semantic::kWeights);
  const bool rigid = part.rigid() || joints == nullptr || weights == nullptr;
  for (std::uint32_t t = 0; t < part.target_count; ++t) {
    const double most = static_cast<double>(bones[part.bone_count + t][0].w);
    for (int axis = 0; axis < 3; ++axis) rest[axis] += most * morph_part(layout, vertex, axis, t);
  }
  glm::dvec3 sum(0.0);
  for (std::uint32_t i = 0; i < (rigid ? 1 : 4); ++i) {
    const double weight = rigid ? 1.0 : decode_component(*weights, vertex, i);
    const auto bone = rigid ? 0u : static_cast<std::uint32_t>(decode_component(*joints, vertex, i));
    if (bone >= part.bone_count) continue;
    for (int row = 0; row < 3; ++row) {
      const glm::dvec4 line(bones[bone][row]);
      sum[row] += weight * (line.x * rest.x + line.y * rest.y + line.z * rest.z + line.w);
    }
  }
  return sum;
}

/// Steps to the chunk's nearest triangle, or `nearest`.
double meet_chunk(const BundleView& bundle, const DrawItem& item, const ChunkRecord& rest,
                  const Ray& ray, double nearest) {
  const LayoutRecord& layout = bundle.layouts()[bundle.models()[item.model].layout];
  const std::uint32_t number = item.bones == nullptr ? kNone : part_of(bundle, rest.material);
  const PartRecord* part = number == kNone ? nullptr : &bundle.moving_parts()[number];
  const BoneMatrix* bones = item.bones;
  if (part != nullptr) bones += part->first_bone - bones_of(bundle, item.model).first;
  const ChunkRecord chunk = part == nullptr ? rest : boxed(rest, *part, bones);
  const AttributeRecord* position = find_attribute(layout, Semantic::kPosition);
  const LevelRecord& level = bundle.levels()[chunk.first_level];
  if (position == nullptr || !meets_box(ray, chunk, nearest)) return nearest;
  const std::byte* indices = bundle.indices().data() + level.index_offset;
  const std::byte* vertices = bundle.vertices().data() + level.vertex_offset;
  const auto corner = [&](std::size_t i) {
    const std::size_t index = load_number<std::uint16_t>(indices + 2 * i);
    // Payloads are bounded, not read, by BundleView::open().
    if (index >= level.vertex_count) return glm::dvec3(std::numeric_limits<double>::quiet_NaN());
    const std::byte* vertex = vertices + index * layout.stride;
    glm::dvec3 point;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      point[static_cast<int>(axis)] =
          static_cast<double>(chunk.position_offset[axis]) +
          static_cast<double>(chunk.position_step) * decode_component(*position, vertex, axis);
    }
    return part == nullptr ? point : turned(layout, vertex, *part, bones, point);
  };
  for (std::size_t i = 0; i + 2 < level.index_count; i += 3) {
    nearest = std::min(nearest, meet_triangle(ray, {corner(i), corner(i + 1), corner(i + 2)}));
  }
  return nearest;
}

}  // namespace

std::optional<Pick> pick(const BundleView& bundle, const Camera& camera, glm::dvec2 pixel,
                         std::span<const DrawItem> items) {
  // In GL's eye space; a step is one unit of depth, so that steps compare between items.
  const glm::dvec3 direction((pixel.x - camera.cx) / camera.fx, (camera.cy - pixel.y) / camera.fy,
                             -1.0);
  double nearest = std::numeric_limits<double>::infinity();
  std::optional<Pick> found;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const bool picture = is_picture(bundle, items[i].node);
    if (!picture && items[i].model >= bundle.models().size()) continue;
    const glm::dmat4 to_model = glm::affineInverse(glm::dmat4(items[i].to_eye));
    const Ray ray{glm::dvec3(to_model[3]), glm::dmat3(to_model) * direction};
    const ModelRecord none{};
    const ModelRecord& model = picture ? none : bundle.models()[items[i].model];
    double met = picture ? meet_square(ray, nearest) : nearest;
    std::uint32_t material = kNone;
    for (std::uint32_t c = model.first_chunk; c < model.first_chunk + model.chunk_count; ++c) {
      const double before = met;
      const ChunkRecord& chunk = bundle.chunks()[c];
      met = meet_chunk(bundle, items[i], chunk, ray, met);
      if (met < before) material = chunk.material;
    }
    if (!(met < nearest)) continue;
    nearest = met;
    found = Pick{i, glm::vec3(ray.from + met * ray.step),
                 static_cast<float>(met * glm::length(direction)), material};
  }
  return found;
}

}  // namespace modar
