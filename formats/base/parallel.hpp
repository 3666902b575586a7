// Splits rows of work among threads; what each row does must not depend on the split.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace modar {

/// Runs work() on `threads` threads, this one among them; on this one alone where the system has no
/// second processor to offer. Returns when all have ended. work must not throw.
template <class Work>
void run_on_threads(unsigned threads, const Work& work) {
  std::vector<std::thread> others;
  if (std::thread::hardware_concurrency() == 1) threads = 1;
  for (unsigned i = 1; i < threads; ++i) others.emplace_back(work);
  work();
  for (std::thread& thread : others) thread.join();
}

/// Calls body(row) once for each row of [0, rows), on at most `jobs` threads (0 and 1: this one).
/// Returns when all have run. body must write only what belongs to its row, and must not throw.
template <class Body>
void parallel_rows(std::uint32_t rows, unsigned jobs, const Body& body) {
  const unsigned threads = std::min({jobs, static_cast<unsigned>(rows), 256U});
  if (threads <= 1) {
    for (std::uint32_t row = 0; row < rows; ++row) body(row);
    return;
  }
  std::atomic<std::uint32_t> next{0};
  const auto work = [&] {
    for (std::uint32_t row = next++; row < rows; row = next++) body(row);
  };
  run_on_threads(threads, work);
}

}  // namespace modar
