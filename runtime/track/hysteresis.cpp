// The article's two-frame rule: appear after two detections in sequence, outlive two misses.
#include "modar/tracker.hpp"

namespace modar {
namespace {

constexpr int kFramesToShow = 2;
constexpr int kFramesToKeep = 2;

}  // namespace

Hysteresis::Hysteresis(std::size_t pattern_count)
    : counters_(pattern_count), states_(pattern_count) {}

std::span<const Hysteresis::State> Hysteresis::step(std::span<const Detection> visible) {
  for (Counter& counter : counters_) counter.state.measured = false;
  for (const Detection& detection : visible) {
    if (detection.pattern >= counters_.size()) continue;
    Counter& counter = counters_[detection.pattern];
    counter.state.measured = true;
    counter.state.pose = detection.pose;
  }
  for (std::size_t i = 0; i < counters_.size(); ++i) {
    Counter& counter = counters_[i];
    if (counter.state.measured) {
      // Counting further would only overflow in a session of years.
      if (counter.seen < kFramesToShow) ++counter.seen;
      counter.missed = 0;
      if (counter.seen >= kFramesToShow) counter.state.shown = true;
    } else {
      counter.seen = 0;
      if (counter.missed <= kFramesToKeep) ++counter.missed;
      if (counter.missed > kFramesToKeep) counter.state.shown = false;
    }
    states_[i] = counter.state;
  }
  return states_;
}

}  // namespace modar
