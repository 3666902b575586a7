// `modar-lab bench views`: how much two bundles of one model differ from a third on pictures.
// Internal to bake/extensions/lab.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/bench.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// inputs: three bundles of one model each, in equal source units: the finest; ours, at levels of
/// no more triangles than the reference has (to 3 %); the reference. Draws each from 12 sides, 50
/// and 200 pixels wide. Rows: mean difference from the finest over pixels with a model (of 255,
/// pixels averaged over 64 samples); share of the views that differ by more than 1.5; triangles;
/// draw calls. Of one bundle: the same for the levels that a renderer chooses, 16 to 384 pixels
/// wide, and triangles and draw calls on devices without ES 3. Errors: kUsage "bench.inputs",
/// kInvalidInput "bench.inputs", those of opening bundles and of the renderer.
Result<std::vector<BenchRow>> bench_views(const std::vector<std::string>& inputs);

}  // namespace modar
