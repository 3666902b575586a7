// A progress bar on standard error, where that is a terminal.
#pragma once

#include <cstdint>

namespace modar {

class Progress {
 public:
  /// Prints nothing unless `wanted` and standard error is a terminal.
  explicit Progress(bool wanted);
  /// total: 0 where it is unknown.
  void step(std::uint64_t frames, std::uint64_t total, std::uint64_t visible);
  /// Clears the bar's line.
  void end();

 private:
  bool shown_ = false;
  std::int64_t last_ns_ = 0;
};

}  // namespace modar
