// Other programs that a command runs, a folder for what it hands them, and the places of ModAR's
// own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace modar {

/// A folder of our own under the system's temporary one, removed with all that is in it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder();
  /// Empty where it could not be made.
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

struct ProcessRequest {
  std::vector<std::string> words;        ///< the program, looked up in PATH, and its arguments
  std::vector<std::string> environment;  ///< "NAME=value"; empty: ours
  std::string output;                    ///< file that stdout goes to; empty: nowhere
};

/// What a program that has ended took: exit code (as run_process() answers it), processor time of
/// user and system together, greatest resident size.
struct ProcessOutcome {
  int exit = -1;
  double cpu_seconds = 0;
  double wall_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;
};

ProcessOutcome run_measured(const ProcessRequest& request);

/// Runs it to its end. Answers its exit code, or -1 where it could not be started or was killed.
int run_process(const ProcessRequest& request);

/// Whether PATH has a program of this name.
bool is_installed(const std::string& program);

/// Path of the running program's folder: that of all programs of ModAR.
std::string program_folder();
/// Path of a file that is installed with the programs, but that only they load or run.
std::string companion_file(const std::string& name);

}  // namespace modar
