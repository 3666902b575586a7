// Runs tasks that may hang or exhaust the memory in child processes with limits.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace modar {

struct ProcessLimits {
  /// Of wall time, and of processor time: a bust of 70,000 triangles takes 0.4 s in all.
  unsigned seconds = 120;
  std::size_t memory_bytes = 4ull << 30;  ///< of address space; not enforced under a sanitizer
};

using TaskResult = std::optional<std::vector<std::byte>>;

/// Calls task(i) for each i below `count` in a child process of its own, at most `jobs` at once,
/// and collects the results; nothing for a task that returned nothing, crashed or exceeded a limit.
/// The caller must have no other threads.
std::vector<TaskResult> run_limited(std::size_t count, unsigned jobs, const ProcessLimits& limits,
                                    const std::function<TaskResult(std::size_t)>& task);

}  // namespace modar
