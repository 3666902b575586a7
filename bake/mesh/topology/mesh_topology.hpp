// Topology of a model's surface: components, boundary loops, parts that are not manifold.
#pragma once

#include "bake/mesh/tri_mesh.hpp"

namespace modar {

struct TopologyOptions {
  unsigned jobs = 1;                  ///< threads; the result does not depend on it
  std::uint64_t half_edge_bytes = 0;  ///< that OpenMesh's mesh may take; 0: no limit
};

/// Measures a mesh without changing it. Adds diagnostics that modellers want to know:
/// "model.non-manifold", "model.duplicate-faces", "model.flipped", "model.copied-faces".
MeshTopology measure_topology(const TriMesh& mesh, const TopologyOptions& options, Report& report);

}  // namespace modar
