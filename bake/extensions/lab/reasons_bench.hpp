// Whether the tracker says why it shows nothing: views that hide a print for a known cause.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/bench.hpp"
#include "bake/extensions/lab/pose_bench.hpp"

namespace modar {

/// Renders options.frames views of each of ten causes: a hand holds options.patterns before a
/// camera of 640x480. A view in which the tracker shows the print ends with no reason: it is drawn
/// again, harder. only: causes whose name holds this text. Rows "cause: reason" of all views of the
/// cause, then "right" of all. Errors: as of bench_detection().
Result<std::vector<BenchRow>> bench_reasons(const PoseBenchOptions& options,
                                            const std::string& only,
                                            const ProgressCallback& progress);

}  // namespace modar
