// The cost of many patterns in one bundle, and how soon a hidden pattern is detected again.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/pose_bench.hpp"

namespace modar {

/// One figure of a bundle of `patterns` patterns.
struct ManyBenchRow {
  std::string measure;
  int patterns = 0;
  double value = 0;
  /// Detection: the time with one pattern times `patterns`, or the share that a search for the
  /// shown pattern alone gets right; returns: how often a pattern was hidden; 0: none.
  double reference = 0;
};

/// Detection, set-up and return with 1, 10 and options.many patterns: the options' pictures, or
/// where they are fewer, their quarters, and those mirrored. Single-threaded; options.frames:
/// frames of each count, which show the patterns in turn, and how often a pattern is hidden. only:
/// text in the names of the parts that run (detection, tilt, coming, ready, return). Measures as in
/// bake/commands/json.md. Errors: kUsage "bench.input" for too few pictures or no background; those
/// of baking and of the tracker.
Result<std::vector<ManyBenchRow>> bench_many(const PoseBenchOptions& options,
                                             const std::string& only,
                                             const ProgressCallback& progress);

}  // namespace modar
