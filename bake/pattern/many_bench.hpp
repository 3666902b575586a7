// What many patterns in one bundle cost, and how soon a pattern that was hidden is back.
#pragma once

#include <string>
#include <vector>

#include "bake/pattern/pose_bench.hpp"

namespace modar {

/// One figure of a bundle of `patterns` patterns.
struct ManyBenchRow {
  std::string measure;
  int patterns = 0;
  double value = 0;
  double reference = 0;  ///< detection: the time with one pattern, times `patterns`; 0: none
};

/// Detection, set-up and return with 1, 10 and 50 patterns: quarters of the options' pictures, and
/// their mirror images, which no loop takes for one another. Single thread; options.frames: frames
/// of each count, all showing the first pattern, and times that a pattern is hidden. Measures as in
/// bake/commands/json.md. Errors: kUsage "bench.input" for fewer than seven pictures or no
/// background; those of baking and of the loop.
Result<std::vector<ManyBenchRow>> bench_many(const PoseBenchOptions& options,
                                             const PoseBenchProgress& progress);

}  // namespace modar
