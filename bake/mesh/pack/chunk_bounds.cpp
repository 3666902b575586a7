// Boxes and normal cones of chunks.
#include "bake/mesh/pack/chunk_bounds.hpp"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Rounding of the axis to float, of the renderer's normalisation and of its dot product.
constexpr double kConeSlack = 1e-4;

/// Unit normal of triangle i, or zero where it has no area.
glm::dvec3 face_normal(std::span<const glm::vec3> positions, std::span<const std::uint16_t> indices,
                       std::size_t i) {
  const glm::dvec3 a(positions[indices[i]]);
  const glm::dvec3 b(positions[indices[i + 1]]);
  const glm::dvec3 c(positions[indices[i + 2]]);
  const glm::dvec3 n = glm::cross(b - a, c - a);
  const double length = glm::length(n);
  return length > 0 ? n / length : glm::dvec3(0.0);
}

}  // namespace

ChunkBounds chunk_bounds(std::span<const glm::vec3> positions,
                         std::span<const std::uint16_t> indices) {
  ChunkBounds bounds;
  if (positions.empty()) return bounds;
  bounds.low = positions[0];
  bounds.high = positions[0];
  for (const glm::vec3& p : positions) {
    bounds.low = glm::min(bounds.low, p);
    bounds.high = glm::max(bounds.high, p);
  }
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < indices.size(); i += 3) sum += face_normal(positions, indices, i);
  const double length = glm::length(sum);
  if (!(length > 0)) return bounds;
  const glm::vec3 axis(sum / length);
  double least = 1.0;
  for (std::size_t i = 0; i < indices.size() && least > 0; i += 3) {
    const glm::dvec3 n = face_normal(positions, indices, i);
    if (n != glm::dvec3(0.0)) least = std::min(least, glm::dot(n, glm::dvec3(axis)));
  }
  // Half the opening is acos(least). A direction within 90 degrees less that of the axis meets
  // every triangle from behind: its cosine with the axis is at least sin(acos(least)).
  const double cutoff = std::sqrt(std::max(0.0, 1.0 - least * least)) + kConeSlack;
  if (least <= 0 || cutoff >= 1.0) return bounds;
  bounds.cone_axis = axis;
  bounds.cone_cutoff = static_cast<float>(cutoff);
  return bounds;
}

}  // namespace modar
