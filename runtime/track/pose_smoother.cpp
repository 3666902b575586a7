// The 1 Euro filter on a pose: one speed, and so one cut-off, for all six parameters.
#include "modar/pose_smoother.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace modar {
namespace {

// Radians per second that halve the latency: about what a hand at rest does. Lower lags less,
// higher jitters less. Not measured; neither are the next two.
constexpr double kHalvingSpeed = 0.05;
// Time constant of the speed's own filter: longer reacts later, shorter takes jitter for motion.
constexpr double kSpeedTime_s = 0.1;
// Between frames; after it the motion is unknown.
constexpr double kMaxGap_s = 0.5;

glm::dvec3 turn_between(const Pose& from, const Pose& to) {
  return rotation_vector(to.rotation * glm::transpose(from.rotation));
}

double blend(double seconds, double constant) {
  return seconds / (seconds + constant);
}

}  // namespace

[[gnu::cold]] PoseSmoother::PoseSmoother(std::size_t pattern_count, double max_latency_ms,
                                         std::size_t copies)
    : pattern_count_(pattern_count),
      states_(pattern_count * copies),
      max_latency_s_(std::clamp(max_latency_ms, 0.0, 1000.0) * 1e-3) {}

/// Returns the latency in seconds.
double PoseSmoother::smooth(double time_s, State& state, Detection& detection) const {
  Pose& pose = detection.pose;
  const double seconds = time_s - state.time_s;
  const bool fresh = !state.known || !(seconds > 0.0) || seconds > kMaxGap_s;
  const Pose raw = pose;
  double latency = 0.0;
  if (fresh) {
    state.speed = 0.0;
    state.smooth = raw;
    state.corners = detection.corners;
    state.stretch = detection.stretch;
  } else {
    const double depth = std::max(raw.translation.z, 1e-9);
    const double moved = glm::length(turn_between(state.raw, raw)) +
                         glm::length(raw.translation - state.raw.translation) / depth;
    state.speed += blend(seconds, kSpeedTime_s) * (moved / seconds - state.speed);
    latency = max_latency_s_ / (1.0 + state.speed / kHalvingSpeed);
    const double part = blend(seconds, latency);
    state.smooth.rotation =
        rotation_matrix(part * turn_between(state.smooth, raw)) * state.smooth.rotation;
    state.smooth.translation += part * (raw.translation - state.smooth.translation);
    state.stretch += part * (detection.stretch - state.stretch);
    for (std::size_t i = 0; i < state.corners.size(); ++i) {
      state.corners[i] += part * (detection.corners[i] - state.corners[i]);
    }
  }
  state.known = true;
  state.time_s = time_s;
  state.raw = raw;
  pose = state.smooth;
  detection.corners = state.corners;
  detection.stretch = state.stretch;
  return latency;
}

double PoseSmoother::step(double time_s, std::span<Detection> visible) {
  if (max_latency_s_ == 0.0) return 0.0;
  double slowest = 0.0;
  for (State& state : states_) state.seen = false;
  for (Detection& detection : visible) {
    const std::size_t at = detection.copy * pattern_count_ + detection.pattern;
    if (detection.pattern >= pattern_count_ || at >= states_.size()) continue;
    State& state = states_[at];
    state.seen = true;
    slowest = std::max(slowest, smooth(time_s, state, detection));
  }
  for (State& state : states_) state.known = state.known && state.seen;
  return slowest * 1e3;
}

}  // namespace modar
