// The clock of the benches: a shared machine's wall time says little.
#pragma once

#include <ctime>

namespace modar {

/// CPU seconds of the calling thread.
inline double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace modar
