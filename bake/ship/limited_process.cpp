#include "bake/ship/limited_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>

namespace modar {
namespace {

using Clock = std::chrono::steady_clock;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitMemory = false;  // their shadow memory needs terabytes of addresses
#else
constexpr bool kLimitMemory = true;
#endif

struct Child {
  std::size_t task = 0;
  pid_t pid = -1;
  int pipe = -1;
  Clock::time_point deadline;
  std::vector<std::byte> bytes;
};

bool write_all(int descriptor, const std::byte* bytes, std::size_t size) {
  while (size != 0) {
    const ssize_t done = ::write(descriptor, bytes, size);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    bytes += done;
    size -= static_cast<std::size_t>(done);
  }
  return true;
}

[[noreturn]] void run_child(int pipe, const ProcessLimits& limits,
                            const std::function<TaskResult()>& task) {
  const rlimit seconds{limits.seconds, limits.seconds + 1};
  ::setrlimit(RLIMIT_CPU, &seconds);
  const rlimit memory{limits.memory_bytes, limits.memory_bytes};
  if (kLimitMemory) ::setrlimit(RLIMIT_AS, &memory);
  const rlimit core{0, 0};
  ::setrlimit(RLIMIT_CORE, &core);
  bool sent = false;
  try {
    const TaskResult result = task();
    sent = result && write_all(pipe, result->data(), result->size());
  } catch (...) {  // out of memory, or a library threw: no result
  }
  ::_exit(sent ? 0 : 1);
}

Child start(std::size_t task, const ProcessLimits& limits,
            const std::function<TaskResult(std::size_t)>& work) {
  Child child;
  child.task = task;
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return child;
  child.pid = ::fork();
  if (child.pid == 0) {
    ::close(ends[0]);
    run_child(ends[1], limits, [&] { return work(task); });
  }
  ::close(ends[1]);
  child.pipe = ends[0];
  child.deadline = Clock::now() + std::chrono::seconds(limits.seconds);
  return child;
}

/// Reads available bytes; false once the child has closed its end.
bool drain(Child& child) {
  std::array<std::byte, 65536> buffer;
  const ssize_t size = ::read(child.pipe, buffer.data(), buffer.size());
  if (size < 0) return errno == EINTR || errno == EAGAIN;
  child.bytes.insert(child.bytes.end(), buffer.begin(), buffer.begin() + size);
  return size != 0;
}

TaskResult reap(Child& child) {
  ::close(child.pipe);
  int status = 0;
  while (::waitpid(child.pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return std::nullopt;
  return std::move(child.bytes);
}

}  // namespace

std::vector<TaskResult> run_limited(std::size_t count, unsigned jobs, const ProcessLimits& limits,
                                    const std::function<TaskResult(std::size_t)>& task) {
  std::vector<TaskResult> results(count);
  std::vector<Child> children;
  std::size_t next = 0;
  while (next < count || !children.empty()) {
    while (next < count && children.size() < std::max(1u, jobs)) {
      Child child = start(next++, limits, task);
      if (child.pid > 0) children.push_back(std::move(child));
    }
    std::vector<pollfd> waiting;
    for (const Child& child : children) waiting.push_back({child.pipe, POLLIN, 0});
    ::poll(waiting.data(), waiting.size(), 100);
    for (std::size_t i = children.size(); i-- > 0;) {
      Child& child = children[i];
      if (Clock::now() > child.deadline) ::kill(child.pid, SIGKILL);
      if (waiting[i].revents == 0 || drain(child)) continue;
      results[child.task] = reap(child);
      children.erase(children.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  return results;
}

}  // namespace modar
