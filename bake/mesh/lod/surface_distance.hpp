// How far one triangle mesh lies from another.
#pragma once

#include <cstdint>
#include <span>

#include "bake/mesh/lod/level_surface.hpp"

namespace modar {

/// A bound on the distance of any point of one surface from the other: never below the truth, and
/// above it by no more than half, or than kDistanceFloor or `least` where that is more; never below
/// `least`. Both are triangles over the same positions; the measure is one-sided: from points of
/// `from` to the surface `to`. nearby: of each vertex a triangle of `to` that is probably near,
/// kNoIndex where it is not known; where it is wrong, the search only takes longer. Branch and
/// bound as in Tang, Lee, Kim, "Interactive Hausdorff distance computation for general polygonal
/// models", 2009, that goes from triangle to triangle before it searches.
double surface_distance(const LevelSurface& from, LevelSurface& to,
                        std::span<const std::uint32_t> nearby, double least);

/// Finer distances are not told apart: half of what half floats round positions by in [-1,1].
inline constexpr double kDistanceFloor = 0x1p-13;

}  // namespace modar
