// Milliseconds from one stage's end to the next one's.
#pragma once

#include <chrono>

namespace modar {

class LapClock {
 public:
  /// Milliseconds since it was made or asked last.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::milli> ms = now - last_;
    last_ = now;
    return ms.count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace modar
