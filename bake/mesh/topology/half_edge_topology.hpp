// What OpenMesh makes of triangles, without its types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "bake/topology_figures.hpp"

namespace modar {

/// Builds a half-edge mesh. indices: 3 a triangle, different from each other, below vertex_count.
HalfEdgeCount count_half_edges(std::size_t vertex_count, std::span<const std::uint32_t> indices);

}  // namespace modar
