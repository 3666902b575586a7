// Compares the scores of patterns with the working ranges that the tracker reaches on them.
#pragma once

#include <string>
#include <vector>

#include "bake/lab/pose_bench.hpp"

namespace modar {

/// A pattern's score beside its working range, measured on smaller and smaller and steeper and
/// steeper views.
struct ScoreBenchRow {
  std::string name;
  int score = 0;
  double farthest = 0;  ///< distance in roots of the pattern's area, for a focal length of 1280
  double tilt_deg = 0;
  bool tuned = false;  ///< in the half that the score was tuned on: every second by name
  [[nodiscard]] double range() const { return farthest * tilt_deg / 90; }
};

/// options.frames: views of each size and tilt. Errors: those of the benches and of
/// score_pattern().
Result<std::vector<ScoreBenchRow>> bench_scores(const PoseBenchOptions& options,
                                                const ProgressCallback& progress);

/// Spearman's rank correlation; equal values share their mean rank. 0 where one side is constant.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace modar
