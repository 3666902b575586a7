// Takes the trembling out of poses, for drawing, at the price of a latency that it states.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "modar/tracker.hpp"

namespace modar {

/// Low-pass filter of first order whose cut-off rises with speed, after Casiez, Roussel & Vogel,
/// "1 Euro filter" (2012): a resting model does not tremble, a moving one does not lag. What it
/// answers trails a steady motion by exactly the latency that it states.
class PoseSmoother {
 public:
  /// greatest_ms: latency of a resting pattern, 0 to 1000; 0: off, poses pass unchanged. It falls
  /// as 1 / (1 + speed / 0.05), speed in radians a second: of turning plus of the line of sight.
  PoseSmoother(std::size_t pattern_count, double greatest_ms);

  /// time_s: of the frame, rising. Changes the poses alone, not the corners. A pattern that was not
  /// among the last frame's starts anew. Answers the latency of the slowest, milliseconds.
  double step(double time_s, std::span<Detection> visible);

 private:
  struct State {
    bool known = false;
    bool seen = false;
    double time_s = 0;
    double speed = 0;
    Pose raw;
    Pose smooth;
  };
  double smooth(double time_s, State& state, Pose& pose) const;

  std::vector<State> states_;
  double greatest_s_ = 0;
};

}  // namespace modar
