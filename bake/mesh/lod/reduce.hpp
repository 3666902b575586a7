// A mesh with fewer triangles, before it is cut into chunks.
#pragma once

#include <cstddef>

#include "bake/mesh/tri_mesh.hpp"
#include "bake/report.hpp"

namespace modar {

/// Takes triangles out until at most `most_triangles` are left: by quadric errors over the whole
/// mesh, where borders of materials, of uv islands and of hard edges are simplified along
/// themselves and stay closed (meshoptimizer). Vertices that remain keep all their attributes.
/// Meshes that are small enough are returned unchanged. The placement stays that of the source. A
/// finding states the loss: distances of the source's vertices from the new surface. If that number
/// cannot be reached without opening borders, it is a warning.
TriMesh reduce(TriMesh mesh, std::size_t most_triangles, Report& report);

}  // namespace modar
