// Maps a level of a chunk onto a coarser one without a tear: bounds both ways from one pass.
// Internal to lod.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/mesh/lod/level_surface.hpp"

namespace modar {

/// An upper bound on the distance of any point of either level from the other; as tight as
/// surface_distance(), and never below `least`. coarse: `fine` after some half-edge collapses, over
/// the same positions. nearby: for each vertex of `fine` a triangle of `coarse` near it, which it
/// is a corner of where there is such a one; kNoIndex where unknown. of_fine: of each vertex of
/// `fine`, a triangle whose corner it is.
///
/// As Cohen, Manocha, Olano, "Successive mappings", 2003, which maps collapse by collapse: a
/// continuous map moves no point farther than the corners of its linear parts, and covers the
/// coarser level where it does not turn over (its degree). Triangles that cannot be mapped so, or
/// are moved too far, are measured one by one.
double level_distance(LevelSurface& fine, LevelSurface& coarse, std::vector<std::uint32_t> nearby,
                      const std::vector<std::uint32_t>& of_fine, double least);

}  // namespace modar
