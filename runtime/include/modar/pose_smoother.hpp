// Removes jitter from poses, for drawing, at the price of a latency that it reports.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "modar/tracker.hpp"

namespace modar {

/// First-order low-pass filter whose cut-off rises with speed, after Casiez, Roussel & Vogel, "1
/// Euro filter" (2012): a resting model does not jitter, a moving one does not lag. Its output
/// trails a steady motion by exactly the reported latency.
class PoseSmoother {
 public:
  /// max_latency_ms: latency of a resting pattern, 0 to 1000; 0: off, poses pass unchanged. It
  /// falls as 1 / (1 + speed / 0.05), speed in radians per second: of the rotation plus of the line
  /// of sight.
  PoseSmoother(std::size_t pattern_count, double max_latency_ms, std::size_t copies = 1);

  /// time_s: of the frame, increasing. Changes poses, and corners and stretches alike. A pattern
  /// that was not in the last frame starts anew. Returns the largest latency, milliseconds.
  double step(double time_s, std::span<Detection> visible);

 private:
  struct State {
    bool known = false;
    bool seen = false;
    double time_s = 0;
    double speed = 0;
    Pose raw;
    Pose smooth;
    std::array<glm::dvec2, 4> corners{};  ///< smooth, too
    glm::dmat4x3 stretch{1.0};            ///< as well
  };
  double smooth(double time_s, State& state, Detection& detection) const;

  std::size_t pattern_count_;
  std::vector<State> states_;
  double max_latency_s_ = 0;
};

}  // namespace modar
