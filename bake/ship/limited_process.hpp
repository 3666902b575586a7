// Runs tasks that may hang or exhaust the memory in child processes with limits.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace modar {

struct ProcessLimits {
  unsigned seconds = 120;                 ///< of wall time, and of processor time; set by hand
  std::size_t memory_bytes = 4ull << 30;  ///< of address space; not enforced under a sanitizer
};

using TaskResult = std::optional<std::vector<std::byte>>;

/// Calls task(i) for each i below `count` in a child process of its own, at most `jobs` at once,
/// and collects the results; nothing for a task that returned nothing, crashed or exceeded a limit.
/// The caller must have no other threads.
std::vector<TaskResult> run_limited(std::size_t count, unsigned jobs, const ProcessLimits& limits,
                                    const std::function<TaskResult(std::size_t)>& task);

}  // namespace modar
