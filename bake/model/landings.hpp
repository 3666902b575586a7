// Where the vertices that a decimation took out lie on the surface that it left.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace modar {

/// A triangle that stays, by a number of the caller's and the vertices of its corners.
struct LandingFace {
  std::uint32_t face = 0;
  std::array<std::uint16_t, 3> corners{};
};

/// Every vertex that was taken out lies on one triangle: the nearest of those that took the place
/// of the triangles around it, and again when one of those changes.
class Landings {
 public:
  /// The positions are the caller's and must outlive it.
  Landings(std::span<const glm::dvec3> positions, std::size_t faces);

  /// Takes up what lies on a triangle that changes or vanishes.
  void lift(std::uint32_t face);
  /// Takes up a vertex that leaves the mesh.
  void lift_vertex(std::uint16_t vertex) { hand_.push_back(vertex); }
  /// Lays down what was taken up, on the nearest of at least one triangle.
  void settle(std::span<const LandingFace> faces);

  /// kNoIndex where the vertex was not taken out.
  [[nodiscard]] std::uint32_t face_of(std::uint16_t vertex) const { return face_of_[vertex]; }

 private:
  std::span<const glm::dvec3> positions_;
  std::vector<std::uint32_t> face_of_;  // of each vertex
  std::vector<std::uint32_t> first_;    // of each face, the vertices on it as a linked list
  std::vector<std::uint32_t> next_;     // of each vertex
  std::vector<std::uint16_t> hand_;
};

}  // namespace modar
