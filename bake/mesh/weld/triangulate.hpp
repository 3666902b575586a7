// Polygons of any shape to triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace modar {

/// Triangulates one polygon: a fan where it is convex, ears where it is not (Meisters, 1975); the
/// winding stays. positions: its corners in order, 3 or more, not necessarily planar.
/// out: appended corner numbers, positions.size() - 2 triangles. Returns false where the polygon is
/// too tangled, or takes too long, for ear clipping and the rest became a fan.
bool triangulate(std::span<const glm::dvec3> positions,
                 std::vector<std::array<std::uint32_t, 3>>& out);

}  // namespace modar
