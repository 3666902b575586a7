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

StageTimes RunStats::quantile_ms(double share) const {
  StageTimes result{};
  if (times_.empty()) return result;
  std::vector<float> column(times_.size());
  const double last = static_cast<double>(column.size() - 1);
  const auto place = static_cast<std::ptrdiff_t>(share * last);
  for (std::size_t stage = 0; stage < result.size(); ++stage) {
    for (std::size_t i = 0; i < times_.size(); ++i) column[i] = times_[i][stage];
    std::nth_element(column.begin(), column.begin() + place, column.end());
    result[stage] = static_cast<double>(column[static_cast<std::size_t>(place)]);
  }
  return result;
}

}  // namespace modar
