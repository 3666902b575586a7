// Which axis of a model points up, from its geometry.
#pragma once

#include "bake/mesh/tri_mesh.hpp"
#include "bake/up_axis.hpp"

namespace modar {

/// An axis along which a model has at most this share of its largest side is one that it is flat
/// in.
inline constexpr double kFlatShare = 1e-4;

/// The mesh's own statement, unless it rests on mere convention and the geometry is beyond doubt:
/// map coordinates, open ground seen from above, or a tall shape with a base at one end only.
/// Chooses between +y and +z, the two axes that exporters use. Deterministic.
Upright find_up(const TriMesh& mesh);

}  // namespace modar
