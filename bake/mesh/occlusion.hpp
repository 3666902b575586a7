// How much of the light from all around reaches each vertex past the model itself.
#pragma once

#include "bake/memory/array.hpp"
#include "bake/mesh/pack/chunk.hpp"
#include "bake/report.hpp"

namespace modar {

/// One a vertex of the mesh, 0 to 127 (all of it): cosine-weighted rays over the vertex's half
/// space, of which those that end nearer hide more, and what surfaces of middle gray give back of
/// what they hide. What is transparent hides nothing. The triangles are those of the coarsest
/// levels that keep the tree small. The same on any number of threads.
Array<std::uint8_t> measure_occlusion(const ChunkedMesh& chunked, unsigned jobs, Report& report);

}  // namespace modar
