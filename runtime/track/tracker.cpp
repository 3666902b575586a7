// Names and order of reasons, and the two-frame rule of the ModAR paper: a model appears after two
// detections in sequence and outlives two misses.
#include "modar/tracker.hpp"

#include "plane_geometry.hpp"

namespace modar {

const char* to_string(Reason reason) {
  switch (reason) {
    case Reason::kVisible:
      return "visible";
    case Reason::kNoFeatures:
      return "no features";
    case Reason::kFewMatches:
      return "few matches";
    case Reason::kNoGeometry:
      return "not in view";
    case Reason::kFailedVerification:
      return "failed verification";
    case Reason::kLostByBlur:
      return "lost by blur";
    case Reason::kOutOfView:
      return "out of view";
    case Reason::kOtherPrint:
      return "another print";
    case Reason::kCurved:
      return "curved";
    case Reason::kTooSmall:
      return "too small";
    case Reason::kTooDark:
      return "too dark";
    case Reason::kBlurred:
      return "blurred";
    case Reason::kOverexposed:
      return "overexposed";
    case Reason::kGlare:
      return "glare";
    case Reason::kAtTheEdge:
      return "at the edge";
  }
  return "unknown";
}

int progress(Reason reason) {
  switch (reason) {
    case Reason::kVisible:
      return 7;
    case Reason::kOtherPrint:
    case Reason::kCurved:
      return 6;
    case Reason::kLostByBlur:
    case Reason::kOutOfView:
      return 5;
    case Reason::kFailedVerification:
      return 4;
    case Reason::kNoGeometry:
      return 3;
    case Reason::kFewMatches:
      return 2;
    default:
      return 1;
  }
}

namespace {

constexpr int kFramesToShow = 2;
constexpr int kFramesToKeep = 2;

}  // namespace

[[gnu::cold]] Hysteresis::Hysteresis(std::size_t pattern_count, bool predict, bool stills,
                                     std::size_t copies)
    : pattern_count_(pattern_count),
      counters_(pattern_count * copies),
      states_(pattern_count * copies),
      predict_(predict),
      frames_to_show_(stills ? 1 : kFramesToShow) {}

std::span<const Hysteresis::State> Hysteresis::step(std::span<const Detection> visible) {
  for (Counter& counter : counters_) counter.state.measured = false;
  for (const Detection& detection : visible) {
    const std::size_t at = detection.copy * pattern_count_ + detection.pattern;
    if (detection.pattern >= pattern_count_ || at >= counters_.size()) continue;
    Counter& counter = counters_[at];
    counter.state.measured = true;
    counter.moving = predict_ && counter.seen > 0;
    counter.previous = counter.state.pose;
    counter.state.pose = detection.pose;
    counter.state.stretch = detection.stretch;
  }
  for (std::size_t i = 0; i < counters_.size(); ++i) {
    Counter& counter = counters_[i];
    if (counter.state.measured) {
      // Not counted further: it would overflow in a session of years.
      if (counter.seen < frames_to_show_) ++counter.seen;
      counter.missed = 0;
      if (counter.seen >= frames_to_show_) counter.state.shown = true;
    } else {
      counter.seen = 0;
      if (counter.missed <= kFramesToKeep) {
        ++counter.missed;
        if (counter.moving) {
          const Pose next = tracker::extrapolate(counter.previous, counter.state.pose);
          counter.previous = counter.state.pose;
          counter.state.pose = next;
        }
      }
      if (counter.missed > kFramesToKeep) counter.state.shown = false;
    }
    states_[i] = counter.state;
  }
  return states_;
}

}  // namespace modar
