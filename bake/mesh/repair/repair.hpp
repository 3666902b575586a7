// Repairs scans: what repair() changes, a count of the same defects for meshes it does not change,
// and the topology of a mesh: components, boundary loops, parts that are not manifold.
#pragma once

#include "bake/import/source_model.hpp"
#include "bake/mesh/tri_mesh.hpp"
#include "bake/report.hpp"

namespace modar {

/// Removes small islands and repeated triangles, splits edges and positions where more than one
/// surface meets, turns triangles that wind against their neighbours, and closes holes of up to 1 %
/// of the diagonal. Faces become triangles, and open edges that were written twice one. Positions,
/// uvs, normals and colours of all others stay. support: removes the flat surface that a scan is
/// on, too, and warns if no such surface is found.
MeshDefects repair_model(SourceModel& model, bool support, Report& report);

/// How much of that a mesh has. repaired: positions that were split are not one again. viewer: out
/// of the pattern, in the mesh's coordinates; zero: unknown. Takes a hundredth of a bake.
MeshDefects count_defects(const TriMesh& mesh, bool repaired, const glm::dvec3& viewer,
                          Report& report);

/// Measures a mesh without changing it. Adds diagnostics that modellers want to know:
/// "model.non-manifold", "model.duplicate-faces", "model.flipped", "model.copied-faces".
/// half_edge_bytes: that OpenMesh's mesh may take; 0: no limit.
MeshTopology measure_topology(const TriMesh& mesh, std::uint64_t half_edge_bytes, Report& report);

}  // namespace modar
