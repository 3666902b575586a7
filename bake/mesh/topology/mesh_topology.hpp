// How a model's surface hangs together: loops, seams that are none, what no half-edge mesh holds.
#pragma once

#include "bake/mesh/tri_mesh.hpp"

namespace modar {

struct TopologyOptions {
  unsigned jobs = 1;                  ///< threads; the result does not depend on it
  std::uint64_t half_edge_bytes = 0;  ///< that OpenMesh's mesh may take; 0: any
};

/// Measures a mesh; does not change it. Says in findings ("model.non-manifold",
/// "model.duplicate-faces", "model.flipped", "model.copied-faces") what makers of models want to
/// know.
MeshTopology measure_topology(const TriMesh& mesh, const TopologyOptions& options, Report& report);

}  // namespace modar
