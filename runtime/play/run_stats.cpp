// Sums up the frames of a run.
#include "run_stats.hpp"

#include <algorithm>

namespace modar {

void RunStats::add(const FrameReport& report) {
  std::array<float, kStageNames.size()> times{};
  for (std::size_t i = 0; i < times.size(); ++i) times[i] = static_cast<float>(report.ms[i]);
  times_.push_back(times);
  ++states_[static_cast<std::size_t>(report.state)];
  ++reasons_[static_cast<std::size_t>(report.reason)];
  if (!report.visible.empty()) ++visible_;
  if (report.at(Stage::kLatency) > kFrameBudgetMs) ++late_;
}

double RunStats::recognised_percent() const {
  if (times_.empty()) return 0;
  return 100.0 * static_cast<double>(visible_) / static_cast<double>(times_.size());
}

StageTimes RunStats::median_ms() const {
  StageTimes medians{};
  if (times_.empty()) return medians;
  std::vector<float> column(times_.size());
  for (std::size_t stage = 0; stage < medians.size(); ++stage) {
    for (std::size_t i = 0; i < times_.size(); ++i) column[i] = times_[i][stage];
    const auto middle = column.begin() + static_cast<std::ptrdiff_t>((column.size() - 1) / 2);
    std::nth_element(column.begin(), middle, column.end());
    medians[stage] = static_cast<double>(*middle);
  }
  return medians;
}

}  // namespace modar
