// Figures of a model's topology.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace modar {

/// A half-edge mesh, as OpenMesh builds it.
struct HalfEdgeCount {
  std::uint64_t boundary_loops = 0;  ///< where fans touch, a walk goes from one to the next
  std::uint64_t copied_faces = 0;  ///< that it refused, and that stand on copies of their vertices
  std::uint64_t copied_vertices = 0;
};

/// Over the positions that the file's corners refer to (vertices that only differ in uv or normal
/// are one; positions written twice are two) and the triangles that the weld kept.
struct MeshTopology {
  std::string model;           ///< its name
  std::uint64_t vertices = 0;  ///< positions that triangles use
  std::uint64_t edges = 0;     ///< pairs of positions
  std::uint64_t triangles = 0;
  std::uint64_t components = 0;             ///< parts that share no position
  std::uint64_t boundary_edges = 0;         ///< of one triangle
  std::uint64_t non_manifold_edges = 0;     ///< of more than two triangles
  std::uint64_t flipped_edges = 0;          ///< of two triangles that wind against each other
  std::uint64_t non_manifold_vertices = 0;  ///< at such an edge, or where several fans touch
  std::uint64_t duplicate_triangles = 0;    ///< over the same positions as an earlier one
  std::uint64_t boundary_loops = 0;  ///< holes and rims; where fans touch, each goes its own way
  /// What OpenMesh makes of it; nothing where its mesh would not fit in memory.
  std::optional<HalfEdgeCount> half_edges;

  /// Vertices less edges plus faces: 2 for a sphere, 0 for a torus, 1 for a disk.
  [[nodiscard]] std::int64_t euler() const {
    return static_cast<std::int64_t>(vertices + triangles) - static_cast<std::int64_t>(edges);
  }
};

}  // namespace modar
