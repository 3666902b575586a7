// False finds: frames that show none of the patterns, but what looks like parts of them.
#pragma once

#include <vector>

#include "bake/extensions/lab/bench.hpp"
#include "bake/extensions/lab/pose_bench.hpp"

namespace modar {

/// Looks for hard_prints() (and options.patterns) at once in options.clutter_frames frames of
/// 640x480, in turn photos that have nothing to do with each other and sequences in which a hand
/// moves one of other hard prints. A find of the kind that is shown is no false one, and is counted
/// apart, since two prints of a kind share much. Rows of false frames of all frames. Errors: as of
/// bench_detection().
Result<std::vector<BenchRow>> bench_clutter(const PoseBenchOptions& options,
                                            const ProgressCallback& progress);

/// Shows hard_prints() and options.patterns one after the other in a hand in front of a photo, in
/// options.clutter_frames frames in all, to a tracker of up to eight copies of it. Rows, of all
/// prints and of each kind: frames that show more than one copy; and frames that show the print.
/// Errors: as of bench_detection().
Result<std::vector<BenchRow>> bench_phantoms(const PoseBenchOptions& options,
                                             const ProgressCallback& progress);

}  // namespace modar
