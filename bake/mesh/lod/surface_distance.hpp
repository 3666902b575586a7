// A bound on the distance of one triangle mesh from another. Internal to lod.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/mesh/triangle_tree.hpp"

namespace modar {

/// Unit normals of a triangle and of the planes that stand on its edges, looking outwards.
struct EdgePlanes {
  glm::dvec3 normal{0.0};
  std::array<glm::dvec3, 3> outwards{};
  bool known = false;
  bool has_area = false;
};

/// The triangles of one level of a chunk: which are adjacent, which is near a point.
class LevelSurface {
 public:
  /// Of at least one triangle. Both spans are the caller's and must outlive it.
  LevelSurface(std::span<const glm::dvec3> positions, std::span<const std::uint16_t> indices);

  [[nodiscard]] std::span<const std::uint16_t> indices() const { return indices_; }
  [[nodiscard]] std::size_t vertices() const { return positions_.size(); }
  [[nodiscard]] const glm::dvec3& position(std::uint16_t vertex) const {
    return positions_[vertex];
  }
  [[nodiscard]] std::array<glm::dvec3, 3> triangle(std::uint32_t t) const {
    const std::uint16_t* at = &indices_[3 * std::size_t{t}];
    return {positions_[at[0]], positions_[at[1]], positions_[at[2]]};
  }
  /// The triangle beyond the edge from corner i to the next, kNoIndex at a border.
  [[nodiscard]] std::uint32_t neighbour(std::uint32_t t, std::size_t i) const {
    return neighbours_[3 * std::size_t{t} + i];
  }
  /// Of each vertex a triangle whose corner it is, kNoIndex where there is none.
  [[nodiscard]] std::vector<std::uint32_t> triangles_of_vertices() const;
  /// Is there a triangle of these corners, in this order, from whichever it begins?
  [[nodiscard]] bool has(const std::uint16_t* corners) const;
  /// Built on first use.
  TriangleTree& tree();
  /// Computed on first use.
  const EdgePlanes& planes(std::uint32_t t);

 private:
  std::span<const glm::dvec3> positions_;
  std::span<const std::uint16_t> indices_;
  std::vector<std::uint32_t> begins_;   ///< of each vertex: where its corners begin in corners_
  std::vector<std::uint32_t> corners_;  ///< by vertex
  std::vector<std::uint32_t> neighbours_;
  std::unique_ptr<TriangleTree> tree_;
  std::vector<EdgePlanes> planes_;
};

/// An upper bound on the distance of any point of one surface from the other. It exceeds the true
/// distance by no more than half of it (or kDistanceFloor, or `least`, where that is more), and is
/// never below `least`. Both are triangles over the same positions; the measure is one-sided: from
/// points of `from` to the surface `to`. nearby: for each vertex a triangle of `to` that is
/// probably near, kNoIndex where unknown; wrong ones only slow the search down. Branch and bound as
/// in Tang, Lee, Kim, "Interactive Hausdorff distance computation for general polygonal models",
/// 2009, walking from triangle to triangle before it searches the tree.
double surface_distance(const LevelSurface& from, LevelSurface& to,
                        std::span<const std::uint32_t> nearby, double least);

/// Smaller distances are not told apart: half of the rounding error of half floats in [-1,1].
inline constexpr double kDistanceFloor = 0x1p-13;

}  // namespace modar
