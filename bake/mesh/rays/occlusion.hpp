// How much of the light from all around reaches each vertex past the model itself.
#pragma once

#include <cstddef>

#include "bake/memory/array.hpp"
#include "bake/mesh/pack/chunk.hpp"
#include "bake/report.hpp"

namespace modar {

/// Cost 20 to 32 rays each, of 60 to 150 ns. Clusters of a scan that fills the box are then a
/// hundredth of its side wide, and of one without layers a fiftieth. Against 256 rays from every
/// vertex, a bust of 560,000 vertices in 31,000 clusters is off by 0.030 (root of the mean square),
/// a scan in loose layers of 96,900 by 0.11.
inline constexpr std::size_t kOcclusionPoints = 62'500;

/// One a vertex of the mesh, 0 to 127 (all of it): cosine-weighted rays over the vertex's half
/// space, of which those that end nearer hide more, and what surfaces of middle gray give back of
/// what they hide. What is transparent hides nothing. Where there are more
/// vertices than `most_points`, about as many clusters of near vertices that look the same way are
/// measured, or a quarter where the surface has no layers. The same on any number of threads.
Array<std::uint8_t> measure_occlusion(const ChunkedMesh& chunked, unsigned jobs, Report& report,
                                      std::size_t most_points = kOcclusionPoints);

}  // namespace modar
