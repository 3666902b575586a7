// Normals for corners that the file gives none: weighted by area and angle, within smoothing
// groups.
#pragma once

#include <cstdint>

#include <glm/vec3.hpp>

#include "bake/import/source_model.hpp"

namespace modar {

/// Collects the faces round each (position, smoothing group); a group of 0 makes flat faces.
/// Weights: area times the angle at the corner, so that neither thin nor many triangles of one flat
/// side tilt the normal (Max, "Weights for computing vertex normals from facet normals", 1999, for
/// the area; Thuermer and Wuethrich, 1998, for the angle).
class NormalMaker {
 public:
  /// Starts over with `count` normals, numbered by the caller.
  void reset(std::size_t count);
  /// Number of the normal shared by the corners of this position and group; made on first use.
  std::uint32_t node(std::uint32_t position, std::uint32_t group, std::size_t position_count);
  /// Number of a normal of one face alone.
  std::uint32_t flat_node();
  /// Adds a triangle's share to one corner. cross: twice its area vector; a: the corner's position.
  void add(std::uint32_t node, const glm::dvec3& cross, const glm::dvec3& a, const glm::dvec3& b,
           const glm::dvec3& c);
  /// Unit normals by number; (0, 0, 1) where the shares cancel.
  [[nodiscard]] Array<glm::dvec3> take_normals();
  [[nodiscard]] bool empty() const { return sums_.empty(); }

 private:
  Array<std::uint32_t> first_;  // of each position, kNoIndex where none
  Array<std::uint32_t> next_;   // of each node
  Array<std::uint32_t> group_;
  Array<glm::dvec3> sums_;
};

}  // namespace modar
