// Decimates a chunk: fewer triangles over the same vertices. Internal to lod.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace modar {

/// The vertices of a chunk. uvs: one a position, in a unit of the caller's, or none.
struct ChunkVertices {
  std::span<const glm::dvec3> positions;
  std::span<const glm::dvec2> uvs;
};

/// A triangle that is kept: the caller's number of it, and its corners.
struct KeptTriangle {
  std::uint32_t face = 0;
  std::array<std::uint16_t, 3> corners{};
};

/// The distance between a vertex' uv and the uv of the nearest point of some triangles (at least
/// one).
double uv_shift_of(const ChunkVertices& vertices, std::uint16_t vertex,
                   std::span<const KeptTriangle> faces);

/// Maps every removed vertex to a triangle of the remaining surface: the nearest of those that
/// replaced its triangles, updated whenever one of them changes. Measures how far the texture has
/// slid there.
class RemovedVertexMap {
 public:
  /// The vertices are the caller's and must outlive it.
  RemovedVertexMap(const ChunkVertices& vertices, std::size_t faces);

  /// Detaches the removed vertices of a triangle that changes or vanishes.
  void detach_triangle(std::uint32_t face);
  /// Adds a vertex that is being removed.
  void detach_vertex(std::uint16_t vertex) { detached_.push_back(vertex); }
  /// Maps all detached vertices to the nearest of some triangles (at least one).
  void reattach(std::span<const KeptTriangle> faces);

  /// kNoIndex for a vertex that was not removed.
  [[nodiscard]] std::uint32_t face_of(std::uint16_t vertex) const { return face_of_[vertex]; }
  /// Greatest of uv_shift_of() of the vertices on the triangle.
  [[nodiscard]] double uv_shift(std::uint32_t face) const { return uv_shifts_[face]; }

 private:
  ChunkVertices vertices_;
  std::vector<std::uint32_t> face_of_;  // of each vertex
  std::vector<std::uint32_t> first_;    // of each face, the vertices on it as a linked list
  std::vector<std::uint32_t> next_;     // of each vertex
  std::vector<double> uv_shifts_;       // of each face
  std::vector<std::uint16_t> detached_;
};

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
