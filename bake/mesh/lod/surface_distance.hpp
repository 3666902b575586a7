// A bound on the distance of one triangle mesh from another. Internal to lod.
#pragma once

#include <cstdint>
#include <span>

#include "bake/mesh/lod/level_surface.hpp"

namespace modar {

/// An upper bound on the distance of any point of one surface from the other. It exceeds the true
/// distance by no more than half of it (or kDistanceFloor, or `least`, where that is more), and is
/// never below `least`. The measure is one-sided: from points of `from` to the surface `to`.
/// Triangles of both over the same positions are not looked at. nearby: for each vertex a triangle
/// of `to` that is probably near, kNoIndex where unknown; wrong ones only slow the search down.
/// Branch and bound as in Tang, Lee, Kim, "Interactive Hausdorff distance computation for general
/// polygonal models", 2009, walking from triangle to triangle before it searches the tree. found: a
/// distance between them that is known, from which on the bound may be loose as well. settled: 1
/// for each triangle of `from` that needs no look; may be empty.
template <class Index>
double surface_distance(const BasicLevelSurface<Index>& from, BasicLevelSurface<Index>& to,
                        std::span<const std::uint32_t> nearby, double least, double found = 0,
                        std::span<const std::uint8_t> settled = {});

/// The bound may exceed a distance that was found by this factor: 1.5 keeps coarse levels usable at
/// their distance, and tighter bounds take more subdivisions.
inline constexpr double kSlack = 1.5;

/// Smaller distances are not told apart: half of the rounding error of half floats in [-1,1].
inline constexpr double kDistanceFloor = 0x1p-13;

/// Share of the previous level's error below which a level replaces the finest in measurements.
/// Higher bakes faster and states larger errors. [0.2, 0.4]
inline constexpr double kNegligible = 0.25;

}  // namespace modar
