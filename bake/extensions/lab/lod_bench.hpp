// `modar-lab bench lod`: our levels of detail compared with meshoptimizer's simplifier. Internal to
// bake/extensions/lab.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/bench.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// For each model, and each level of the bundle that `modar bake` makes of it by default: triangles
/// against the number asked for; rms, 99th percentile and greatest distance from the source
/// (percent of the diagonal, sampled evenly by area, the worse of both ways) against
/// meshopt_simplify on the whole mesh at the same number of triangles; the bundle's stated bound
/// against the distance found; and CPU seconds that levels add to a bake against
/// meshopt_simplify's. Errors: those of reading and of the stages, kInvalidInput "bench.bake".
Result<std::vector<BenchRow>> bench_lod(const std::vector<std::string>& models, unsigned jobs);

}  // namespace modar
