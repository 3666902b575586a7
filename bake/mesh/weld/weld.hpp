// SourceModel to TriMesh.
#pragma once

#include "bake/import/source_model.hpp"
#include "bake/mesh/tri_mesh.hpp"
#include "formats/base/error.hpp"

namespace modar {

struct WeldOptions {
  unsigned jobs = 1;   ///< threads; the result does not depend on it
  double crease = 40;  ///< degrees between faces above which an edge is sharp, see make_normals()
};

/// Triangulates (concave polygons by ear clipping), drops what has no area, welds on index triples,
/// makes missing normals (see make_normals()), normalises to
/// [-1,1]. Diagnostics of dropped triangles and made normals go to report.diagnostics. Errors:
/// kInvalidInput "model.empty" where no triangle is left. The overload that takes ownership frees
/// the source's arrays as it goes: large models need half the memory.
Result<TriMesh> weld(SourceModel&& source, Report& report, const WeldOptions& options = {});
Result<TriMesh> weld(const SourceModel& source, Report& report, const WeldOptions& options = {});

}  // namespace modar
