// How much of the light from all around reaches each vertex past the model itself.
#pragma once

#include <cstddef>

#include "bake/memory/array.hpp"
#include "bake/mesh/pack/chunk.hpp"
#include "bake/report.hpp"

namespace modar {

/// Largest number of points that rays start from; larger models are clustered. More are more exact
/// and take proportional time.
inline constexpr std::size_t kOcclusionPoints = 62'500;

/// One a vertex of the mesh, 0 to 127 (all of it): cosine-weighted rays over the vertex's half
/// space, of which those that end nearer hide more, and what surfaces of middle gray give back of
/// what they hide. Transparent triangles hide nothing. Where there are more vertices than
/// `most_points`, about as many clusters of near vertices that look the same way are measured, or a
/// quarter where the surface has no layers; fewer where great numbers of triangles overlap. The
/// same on any number of threads.
Array<std::uint8_t> measure_occlusion(const ChunkedMesh& chunked, unsigned jobs, Report& report,
                                      std::size_t most_points = kOcclusionPoints);

}  // namespace modar
