// Runs the second reader as a process.
#include "bake/check/second_reader.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "formats/atomic_file.hpp"

extern char** environ;

namespace modar {
namespace {

namespace fs = std::filesystem;

/// A folder of our own, removed with all that is in it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "modar-mutate-XXXXXX").string();
    if (!error && ::mkdtemp(name.data()) != nullptr) path_ = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

tl::unexpected<Error> trouble(const std::string& reader, const std::string& cause) {
  return fail(ExitCode::kIo, "mutate.second-reader", reader, cause,
              "name scripts/read_bundle.py with --second-reader, and install python3");
}

/// True if the process ended by itself; a reader that refuses a file answers 3.
bool run(const std::vector<std::string>& words, const std::string& output) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0600);
  pid_t child = 0;
  const int failed =
      ::posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  return failed == 0 && ::waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 3);
}

}  // namespace

Result<std::vector<std::string>> read_scenes(const std::string& reader,
                                             const std::vector<std::span<const std::byte>>& files) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return trouble(reader, "there is no room for temporary files");
  std::vector<std::string> words = {"python3", reader, "--scenes"};
  for (std::size_t i = 0; i < files.size(); ++i) {
    words.push_back((folder.path() / (std::to_string(i) + ".modar")).string());
    if (auto written = write_file(words.back(), files[i]); !written) {
      return tl::unexpected(written.error());
    }
  }
  const std::string output = (folder.path() / "scenes").string();
  if (!run(words, output)) return trouble(reader, "it could not be run, or failed");
  std::vector<std::string> lines;
  std::ifstream text(output);
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  if (lines.size() != files.size()) {
    return trouble(reader, "it told of " + std::to_string(lines.size()) + " files, not of " +
                               std::to_string(files.size()));
  }
  return lines;
}

}  // namespace modar
