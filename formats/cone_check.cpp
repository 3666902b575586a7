// The normal of each triangle, from decoded positions: nothing that the writer stated is believed.
#include "formats/cone_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/component.hpp"
#include "formats/rules.hpp"

namespace modar {
namespace {

/// Of the cut-off: writers round positions, normals and axes in their own ways.
constexpr double kSlack = 1e-3;

using Vector = std::array<double, 3>;

Vector between(const float* from, const float* to) {
  return {static_cast<double>(to[0]) - static_cast<double>(from[0]),
          static_cast<double>(to[1]) - static_cast<double>(from[1]),
          static_cast<double>(to[2]) - static_cast<double>(from[2])};
}

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace

/// Positions as a shader has them, rounded to f32.
void ConeCheck::decode(const BundleParts& parts, const LayoutRecord& layout,
                       const ChunkRecord& chunk, const LevelRecord& level) {
  const AttributeRecord& position = *find_attribute(layout, Semantic::kPosition);
  positions_.resize(3 * std::size_t{level.vertex_count});
  const std::byte* vertex = parts.vertices.data() + level.vertex_offset;
  for (std::size_t v = 0; v < level.vertex_count; ++v, vertex += layout.stride) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      positions_[3 * v + axis] = static_cast<float>(
          static_cast<double>(chunk.position_offset[axis]) +
          static_cast<double>(chunk.position_step) *
              decode_component(position, vertex, static_cast<std::uint32_t>(axis)));
    }
  }
}

ConeCheck::Outside ConeCheck::look(const BundleParts& parts, const LayoutRecord& layout,
                                   const ChunkRecord& chunk, const LevelRecord& level) {
  Outside outside;
  if (chunk.cone_cutoff > 1.0f) return outside;
  decode(parts, layout, chunk, level);
  const auto* indices =
      reinterpret_cast<const std::uint16_t*>(parts.indices.data() + level.index_offset);
  const Vector axis = {static_cast<double>(chunk.cone_axis[0]),
                       static_cast<double>(chunk.cone_axis[1]),
                       static_cast<double>(chunk.cone_axis[2])};
  const double sine = static_cast<double>(chunk.cone_cutoff) + kSlack;
  // Lengths stay squared: no root, no division, and triangles without area pass.
  const double least = std::max(0.0, 1.0 - sine * sine) * dot(axis, axis);
  for (std::uint32_t i = 0; i < level.index_count; i += 3) {
    const float* a = positions_.data() + std::size_t{3} * indices[i];
    const Vector u = between(a, positions_.data() + std::size_t{3} * indices[i + 1]);
    const Vector v = between(a, positions_.data() + std::size_t{3} * indices[i + 2]);
    const Vector n = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                      u[0] * v[1] - u[1] * v[0]};
    const double along = dot(n, axis);
    if (along >= 0 && along * along >= least * dot(n, n)) continue;
    if (outside.count++ == 0) outside.first = i;
  }
  return outside;
}

}  // namespace modar
