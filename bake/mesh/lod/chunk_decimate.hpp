// Fewer triangles over the vertices that there are.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bake/mesh/lod/removed_vertex_map.hpp"

namespace modar {

/// A coarser level: triangles, and where vertices are on them.
struct CoarserTriangles {
  std::vector<std::uint16_t> indices;
  /// Of each vertex a triangle that it is a corner of or, where it was taken out, that lies where
  /// the surface around it was; kNoIndex where no triangle used it.
  std::vector<std::uint32_t> nearby;
  /// Greatest distance of the uv of a vertex that was taken out from that of its triangle, at the
  /// point of it that is nearest to the vertex.
  double uv_shift = 0;
};

struct DecimateLimits {
  /// No collapse whose vertex lies farther from the planes that it stands for (root of the mean
  /// square, by area).
  double max_error = 0;
  /// No collapse that may lead to a greater uv_shift.
  double max_uv_shift = 0;
  /// Length on the surface that a unit of uv covers: the price of a collapse counts both.
  double length_of_uv = 0;
};

/// Collapses edges in the order of quadric errors (Garland and Heckbert, "Surface simplification
/// using quadric error metrics", 1997; OpenMesh's decimater) and of the shift of uvs. Every
/// collapse keeps one of its two vertices as it is, so that the result indexes the same vertices.
/// Kept as they are: vertices that are `locked`, the border of the mesh (seams of uv and normals
/// are one: their vertices differ), and what is not manifold. targets: falling numbers of
/// triangles. Answers one level for each target that was reached, and one more that came near to
/// the next.
std::vector<CoarserTriangles> decimate_chunk(const ChunkVertices& vertices,
                                             std::span<const std::uint16_t> indices,
                                             std::span<const std::uint8_t> locked,
                                             std::span<const std::size_t> targets,
                                             const DecimateLimits& limits);

}  // namespace modar
