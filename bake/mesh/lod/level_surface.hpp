// The triangles of one level of a chunk or a mesh: which are adjacent, which is near a point.
// Internal to lod.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/import/source_model.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"

namespace modar {

/// The next corner of the same triangle.
constexpr std::uint32_t next_corner(std::uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

/// A triangle that is near a point, and the square of its distance.
struct NearTriangle {
  double square = 0;
  std::uint32_t triangle = 0;
};

/// Triangles over some positions, Index: a number of these. A corner (3 t + i) represents the edge
/// from it to the next one.
template <class Index>
class BasicLevelSurface {
 public:
  /// Of at least one triangle. Both spans are the caller's and must outlive it.
  BasicLevelSurface(std::span<const glm::dvec3> positions, std::span<const Index> indices);

  [[nodiscard]] std::span<const Index> indices() const { return indices_; }
  [[nodiscard]] std::uint32_t triangles() const {
    return static_cast<std::uint32_t>(indices_.size() / 3);
  }
  [[nodiscard]] std::size_t vertices() const { return positions_.size(); }
  [[nodiscard]] std::span<const glm::dvec3> positions() const { return positions_; }
  [[nodiscard]] const glm::dvec3& position(Index vertex) const { return positions_[vertex]; }
  [[nodiscard]] const Index* corners(std::uint32_t t) const {
    return &indices_[3 * std::size_t{t}];
  }
  [[nodiscard]] std::array<glm::dvec3, 3> triangle(std::uint32_t t) const {
    const Index* at = corners(t);
    return {positions_[at[0]], positions_[at[1]], positions_[at[2]]};
  }
  /// The corner of the same edge in the triangle beyond it; kNoIndex at a border, and where more
  /// than two triangles meet or face differently.
  [[nodiscard]] std::uint32_t opposite(std::uint32_t corner) const { return opposites_[corner]; }
  /// The triangle beyond the edge from corner i to the next, kNoIndex as opposite().
  [[nodiscard]] std::uint32_t neighbour(std::uint32_t t, std::uint32_t i) const {
    const std::uint32_t corner = opposites_[3 * t + i];
    return corner == kNoIndex ? kNoIndex : corner / 3;
  }
  /// The corners at a vertex.
  [[nodiscard]] std::span<const std::uint32_t> corners_at(Index vertex) const {
    return {corners_.data() + begins_[vertex], corners_.data() + begins_[vertex + std::size_t{1}]};
  }
  /// The only corner whose edge goes from a vertex to another; kNoIndex if none or
  /// several.
  [[nodiscard]] std::uint32_t edge(Index from, Index to) const;
  [[nodiscard]] bool has_edge(Index from, Index to) const;
  /// Of each vertex a triangle whose corner it is, kNoIndex if none.
  [[nodiscard]] std::vector<std::uint32_t> triangles_of_vertices() const;
  /// A triangle of these vertices, in this order, from whichever it begins; kNoIndex: none.
  [[nodiscard]] std::uint32_t find(Index a, Index b, Index c) const;
  /// A triangle near a point, by a walk from triangle to triangle.
  [[nodiscard]] std::uint32_t walk(const glm::dvec3& point, std::uint32_t start) const;
  /// The nearest one as far as those around it tell: the same walk, by distances.
  [[nodiscard]] NearTriangle nearest_around(const glm::dvec3& point, std::uint32_t start) const;
  /// The nearest of all; where some triangle is within `enough` (a square), any such one. near: one
  /// that is probably near, the nearer the faster. It is `near` itself once all searches together
  /// have taken too long.
  NearTriangle nearest(const glm::dvec3& point, double enough, const NearTriangle& near);

 private:
  [[nodiscard]] std::uint32_t fan_size(Index vertex) const {
    return begins_[vertex + std::size_t{1}] - begins_[vertex];
  }
  template <class Callback>
  bool any_edge(Index from, Index to, const Callback& callback) const;

  std::span<const glm::dvec3> positions_;
  std::span<const Index> indices_;
  std::vector<std::uint32_t> begins_;   ///< of each vertex: where its corners begin in corners_
  std::vector<std::uint32_t> corners_;  ///< by vertex
  std::vector<Index> ends_;             ///< of each of these: the vertex that its edge goes to
  std::vector<std::uint32_t> by_end_;   ///< corners_ of wide fans, in the order of their ends
  std::vector<std::uint32_t> opposites_;
  std::size_t looked_ = 0;  ///< by nearest()
  /// A box of space: the triangles whose centres are in a cell of a grid.
  struct Box {
    glm::dvec3 low;
    glm::dvec3 high;
    std::uint32_t first = 0;  ///< in boxed_
    std::uint32_t end = 0;
  };
  void make_boxes();
  std::vector<Box> boxes_;  ///< those with triangles, made for the first search
  std::vector<std::uint32_t> boxed_;
};

using LevelSurface = BasicLevelSurface<std::uint16_t>;  ///< of a chunk
using MeshSurface = BasicLevelSurface<std::uint32_t>;   ///< of a whole mesh

}  // namespace modar
