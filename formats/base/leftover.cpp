// A fixed table of paths: a signal handler may neither lock nor allocate.
#include "formats/base/leftover.hpp"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace modar {
namespace {

/// Paths at a time; more are left behind.
constexpr int kSlots = 512;
std::atomic<char*> paths[kSlots];

void end_by(int signal) {
  remove_leftovers();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

Leftover::Leftover(const std::string& path) {
  char* const copy = ::strdup(path.c_str());
  for (int i = 0; copy != nullptr && i < kSlots; ++i) {
    char* none = nullptr;
    if (!paths[i].compare_exchange_strong(none, copy)) continue;
    slot_ = i;
    return;
  }
  std::free(copy);
}

Leftover::Leftover(Leftover&& other) noexcept : slot_(std::exchange(other.slot_, -1)) {}

Leftover& Leftover::operator=(Leftover&& other) noexcept {
  std::swap(slot_, other.slot_);
  return *this;
}

void Leftover::forget() {
  if (slot_ >= 0) std::free(paths[slot_].exchange(nullptr));
  slot_ = -1;
}

void remove_leftovers() {
  // Taken out of the table, so that no other thread frees a path in use.
  char* taken[kSlots];
  for (int i = 0; i < kSlots; ++i) taken[i] = paths[i].exchange(nullptr);
  // A folder is removed after its files.
  constexpr int kDepth = 4;
  for (int pass = 0; pass < kDepth; ++pass) {
    for (const char* const path : taken) {
      if (path != nullptr && ::unlink(path) != 0) ::rmdir(path);
    }
  }
}

void remove_leftovers_at_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    if (std::signal(signal, end_by) == SIG_IGN) std::signal(signal, SIG_IGN);
  }
}

}  // namespace modar
