// Draws the bar ten times a second at most.
#include "progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "pipeline.hpp"

namespace modar {

Progress::Progress(bool wanted) : shown_(wanted && isatty(STDERR_FILENO) == 1) {}

void Progress::step(std::uint64_t frames, std::uint64_t total, std::uint64_t visible) {
  constexpr std::int64_t kEveryNs = 100'000'000;
  if (!shown_ || (now_ns() - last_ns_ < kEveryNs && frames != total)) return;
  last_ns_ = now_ns();
  std::string bar;
  if (total > 0) {
    constexpr std::uint64_t kCells = 30;
    const std::uint64_t full = std::min(kCells, kCells * frames / total);
    bar = "[" + std::string(full, '#') + std::string(kCells - full, '.') + "] ";
  }
  std::fprintf(stderr, "\r%sframe %llu", bar.c_str(), static_cast<unsigned long long>(frames));
  if (total > 0) std::fprintf(stderr, "/%llu", static_cast<unsigned long long>(total));
  std::fprintf(stderr, ", pattern seen in %llu\033[K", static_cast<unsigned long long>(visible));
}

void Progress::end() {
  if (shown_) std::fprintf(stderr, "\r\033[K");
}

}  // namespace modar
