// Compares the scores of patterns with the working ranges that the tracker reaches on them.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/pose_bench.hpp"
#include "bake/pattern/pattern.hpp"

namespace modar {

/// A pattern's score compared with its working range, measured on smaller and smaller, steeper and
/// steeper, and half-covered views before photos, through a lens with perspective.
struct ScoreBenchRow {
  std::string name;
  int score = 0;
  char grade = 'E';
  double graded = 0;    ///< range_value() of the range that the grade follows from
  ScoreRange measured;  ///< here; `nearest` is not measured
  bool tuned = false;   ///< in the half that the score was tuned on: every second by name
};

/// options.frames: views of each size and tilt. Errors: those of the benches and of
/// score_pattern().
Result<std::vector<ScoreBenchRow>> bench_scores(const PoseBenchOptions& options,
                                                const ProgressCallback& progress);

/// Spearman's rank correlation; equal values share their mean rank. 0 where one side is constant.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace modar
