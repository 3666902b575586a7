// How much of the light from all around reaches each vertex past the model itself.
#pragma once

#include <cstddef>

#include "bake/memory/array.hpp"
#include "bake/mesh/pack/chunk.hpp"
#include "bake/report.hpp"

namespace modar {

/// Costs 16 to 32 rays each, of about 1 us. Set by hand: clusters of a scan that fills the box are
/// then a hundredth of its side wide, a small part of the 0.7 that rays reach.
inline constexpr std::size_t kOcclusionPoints = 62'500;

/// One a vertex of the mesh, 0 to 127 (all of it): cosine-weighted rays over the vertex's half
/// space, of which those that end nearer hide more, and what surfaces of middle gray give back of
/// what they hide. What is transparent hides nothing. Where there are more
/// vertices than `most_points`, about as many clusters of near vertices that look the same way are
/// measured. The same on any number of threads.
Array<std::uint8_t> measure_occlusion(const ChunkedMesh& chunked, unsigned jobs, Report& report,
                                      std::size_t most_points = kOcclusionPoints);

}  // namespace modar
