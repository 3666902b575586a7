// Processes by posix_spawn: no shell reads our file names.
#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <system_error>

#include "bake/process/process.hpp"

extern char** environ;

namespace modar {
namespace {

std::vector<char*> pointers(const std::vector<std::string>& words) {
  std::vector<char*> list;
  for (const std::string& word : words) list.push_back(const_cast<char*>(word.c_str()));
  list.push_back(nullptr);
  return list;
}

}  // namespace

ProcessOutcome run_measured(const ProcessRequest& request) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const std::string output = request.output.empty() ? "/dev/null" : request.output;
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const std::vector<char*> arguments = pointers(request.words);
  const std::vector<char*> variables = pointers(request.environment);
  pid_t child = 0;
  const auto start = std::chrono::steady_clock::now();
  const int failed = ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(),
                                    request.environment.empty() ? environ : variables.data());
  posix_spawn_file_actions_destroy(&actions);
  ProcessOutcome outcome;
  int status = 0;
  rusage usage{};
  if (failed != 0 || ::wait4(child, &status, 0, &usage) != child || !WIFEXITED(status)) {
    return outcome;
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  outcome.exit = WEXITSTATUS(status);
  outcome.cpu_seconds = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                        1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  outcome.wall_seconds = wall.count();
  outcome.peak_rss_bytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
  return outcome;
}

std::string program_folder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path().string();
}

}  // namespace modar
