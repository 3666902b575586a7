// Attributes of a coarse mesh that blend to those of the fine one. Internal to lod.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec4.hpp>

namespace modar {

/// A point of the fine surface, on a triangle of the coarse one.
struct FitPoint {
  std::array<std::uint32_t, 3> corners{};  ///< vertices of the coarse mesh
  std::array<float, 3> weights{};          ///< barycentric
  float area = 0;                          ///< that the point represents
};

/// Moves values towards those that, blended over triangles, differ least from targets, in the mean
/// of squares by area. targets: one a point. groups: of each vertex; vertices of one group have one
/// value. values: one a vertex. Groups without a point keep theirs.
void fit_attributes(std::span<const FitPoint> points, std::span<const glm::vec4> targets,
                    std::span<const std::uint32_t> groups, std::vector<glm::vec4>& values);

}  // namespace modar
