// Long work: programs that run next to the server, one job at a time, and can be cancelled.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// What a program left when it ended.
struct ProcessResult {
  int exit = -1;       ///< -1: killed, or not started
  std::string output;  ///< stdout, 64 MB at most
  std::string errors;  ///< the last 64 KB of stderr
};

/// One job, as its own thread sees it.
class Job {
 public:
  Job(std::uint64_t job_number, std::string job_kind)
      : number(job_number), kind(std::move(job_kind)) {}

  const std::uint64_t number;
  const std::string kind;

  /// Runs a program in `folder` to its end. told: receives each line of stderr. Its files are its
  /// own to write: a job that is cancelled sends SIGTERM, which our commands obey between files.
  /// printed: the same of stdout.
  ProcessResult run(const std::vector<std::string>& words, const std::string& folder,
                    const std::function<void(const std::string&)>& told,
                    const std::function<void(const std::string&)>& printed = {});
  [[nodiscard]] bool cancelled() const { return cancelled_; }
  void cancel();

 private:
  std::atomic<bool> cancelled_{false};
  std::mutex mutex_;
  int process_ = 0;  ///< that runs; 0: none
};

class Jobs {
 public:
  ~Jobs() { end(); }
  /// Runs `work` in a thread of its own. Errors: kUsage "studio.busy" where a job runs.
  Result<std::uint64_t> start(const std::string& kind, std::function<void(Job&)> work);
  /// Whether there was one.
  bool cancel();
  [[nodiscard]] bool busy();
  /// Cancels what runs and waits for it.
  void end();

 private:
  std::mutex mutex_;
  std::uint64_t last_ = 0;
  std::unique_ptr<Job> job_;
  std::atomic<bool> running_{false};
  std::thread thread_;
};

}  // namespace modar
