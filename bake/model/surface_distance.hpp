// How far one triangle mesh lies from another.
#pragma once

#include <cstdint>
#include <span>

#include <glm/vec3.hpp>

namespace modar {

/// A bound on the distance of any point of one surface from the other: never below the truth, and
/// above it by no more than half, or than kDistanceFloor where that is more. Both are
/// triangles over the same positions; the measure is one-sided: from points of `from` to the
/// surface `to`, which has at least one triangle. Branch and bound as in Tang, Lee, Kim,
/// "Interactive Hausdorff distance computation for general polygonal models", 2009.
double surface_distance(std::span<const glm::dvec3> positions, std::span<const std::uint16_t> from,
                        std::span<const std::uint16_t> to);

/// Finer distances are not told apart: half of what half floats round positions by in [-1,1].
inline constexpr double kDistanceFloor = 0x1p-13;

}  // namespace modar
