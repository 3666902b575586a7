// How triangles that are seen through come apart, so that they can be drawn from far to near.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/mesh/tri_mesh.hpp"
#include "formats/draw_order.hpp"

namespace modar {

/// More triangles of one chunk are left in the order that they have. Each takes 24 bytes, 96 KB in
/// all, and a step of the device in every frame.
inline constexpr std::size_t kMostOrderedTriangles = 4096;

/// Cuts triangles of each such material where the plane of another goes through them, so that of
/// any two one is behind: crossed cards. blended: a material each. Adds at most a quarter of the
/// triangles, and 512; materials of more than kMostOrderedTriangles stay unchanged.
void cut_crossing(TriMesh& mesh, const std::vector<bool>& blended);

/// A node for each triangle, and some of planes alone. A triangle on both sides of a plane is
/// sorted by its centre.
std::vector<DrawOrderRecord> draw_order(std::span<const std::array<glm::dvec3, 3>> triangles);

}  // namespace modar
