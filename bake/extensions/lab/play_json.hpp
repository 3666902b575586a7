// What benches read of the lines of `modar-play --json`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// One picture of a run.
struct PlayedFrame {
  std::uint64_t frame = 0;  ///< number in the source
  double time_s = 0;        ///< by the source's clock
  double track_ms = 0;
  double latency_ms = 0;    ///< from the frame's arrival to its picture
  bool recognised = false;  ///< a pattern is seen
  bool drawn = false;       ///< a model is on the picture
};

struct PlayedRun {
  std::vector<PlayedFrame> frames;
  std::uint64_t dropped = 0;  ///< frames that a newer one replaced
  std::uint64_t late = 0;     ///< pictures past the budget of 33.33 ms
  double cpu_percent = 0;     ///< processor time by wall clock; 100: one core, all the time
};

/// Reads what the player printed. Errors: kInvalidInput "bench.play" with the line's number, where
/// a line lacks what json.md promises, or the summary is missing.
Result<PlayedRun> read_played_run(const std::string& lines);

}  // namespace modar
