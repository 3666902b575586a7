// Splits rows of work among threads; what each row does must not depend on the split.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace modar {

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
  std::vector<std::thread> pool;
  pool.reserve(threads - 1);
  for (unsigned i = 1; i < threads; ++i) pool.emplace_back(work);
  work();
  for (std::thread& thread : pool) thread.join();
}

}  // namespace modar
