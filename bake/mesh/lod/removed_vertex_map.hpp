// Where the vertices that a decimation took out lie on the surface that it left.
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

/// A triangle that stays, by a number of the caller's and the vertices of its corners.
struct LandingFace {
  std::uint32_t face = 0;
  std::array<std::uint16_t, 3> corners{};
};

/// The distance between a vertex' uv and that of triangles (at least one) at their point that is
/// nearest to it.
double uv_shift_of(const ChunkVertices& vertices, std::uint16_t vertex,
                   std::span<const LandingFace> faces);

/// Every vertex that was taken out lies on one triangle: the nearest of those that took the place
/// of the triangles around it, and again when one of those changes. What the texture is off by
/// there is measured with it.
class RemovedVertexMap {
 public:
  /// The vertices are the caller's and must outlive it.
  RemovedVertexMap(const ChunkVertices& vertices, std::size_t faces);

  /// Takes up what lies on a triangle that changes or vanishes.
  void lift(std::uint32_t face);
  /// Takes up a vertex that leaves the mesh.
  void lift_vertex(std::uint16_t vertex) { hand_.push_back(vertex); }
  /// Lays down what was taken up, on the nearest of at least one triangle.
  void settle(std::span<const LandingFace> faces);

  /// kNoIndex where the vertex was not taken out.
  [[nodiscard]] std::uint32_t face_of(std::uint16_t vertex) const { return face_of_[vertex]; }
  /// Greatest of uv_shift_of() of the vertices on the triangle.
  [[nodiscard]] double uv_shift(std::uint32_t face) const { return uv_shifts_[face]; }

 private:
  ChunkVertices vertices_;
  std::vector<std::uint32_t> face_of_;  // of each vertex
  std::vector<std::uint32_t> first_;    // of each face, the vertices on it as a linked list
  std::vector<std::uint32_t> next_;     // of each vertex
  std::vector<double> uv_shifts_;       // of each face
  std::vector<std::uint16_t> hand_;
};

}  // namespace modar
