// Work that may freeze or eat the memory, each task in a child process with limits.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace modar {

struct ProcessLimits {
  unsigned seconds = 120;                 ///< of wall time, and of processor time
  std::size_t memory_bytes = 4ull << 30;  ///< of address space; not held under a sanitizer
};

using TaskResult = std::optional<std::vector<std::byte>>;

/// Calls task(i) for each i below `count`, at most `jobs` at once, each in a child of its own, and
/// collects what they return; nothing for a task that returned nothing, crashed or broke a limit.
/// The caller must have no other threads.
std::vector<TaskResult> run_limited(std::size_t count, unsigned jobs, const ProcessLimits& limits,
                                    const std::function<TaskResult(std::size_t)>& task);

}  // namespace modar
