// The two ways to weld, shared between their files. Internal to weld.
#pragma once

#include <cmath>
#include <cstdint>

#include <glm/geometric.hpp>

#include "bake/mesh/tri_mesh.hpp"

namespace modar {

struct WeldCounts {
  std::uint64_t flat = 0;         ///< triangles without area
  std::uint64_t not_finite = 0;   ///< triangles with a nan
  std::uint64_t tangled = 0;      ///< polygons
  std::uint64_t bad_normals = 0;  ///< corners whose normal has no direction
  std::uint64_t made_normals = 0;
};

/// Fills mesh.triangles, triangle_material (as in the source) and the vertex arrays with positions
/// in source units; frees the source's arrays on the way.
void weld_any(SourceModel& source, TriMesh& mesh, WeldCounts& counts);

/// Is every vertex its position, so that there is nothing to look up? True for files of triangles
/// whose corners repeat one index, or lack normals and are smooth throughout.
bool can_weld_directly(const SourceModel& source);

/// The same as weld_any() for such sources, in their own arrays.
void weld_identity_indices(SourceModel& source, TriMesh& mesh, WeldCounts& counts, unsigned jobs);

/// Twice the area vector of a triangle, in doubles.
inline glm::dvec3 area_vector(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return glm::cross(b - a, c - a);
}

inline bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Does a source normal have a direction?
inline bool has_direction(const glm::vec3& n) {
  const float square = glm::dot(n, n);
  return square > 1e-30f && square < 1e30f;
}

/// v turned over; what is no number becomes the image's corner.
inline glm::dvec2 image_uv(const glm::dvec2& uv) {
  if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return glm::dvec2(0.0, 1.0);
  return {uv.x, 1.0 - uv.y};
}

/// colour: in [0,1].
inline glm::u8vec4 byte_colour(const glm::vec3& colour) {
  const glm::vec3 c = colour * 255.0f + 0.5f;
  return {static_cast<std::uint8_t>(c.x), static_cast<std::uint8_t>(c.y),
          static_cast<std::uint8_t>(c.z), std::uint8_t{255}};
}

}  // namespace modar
