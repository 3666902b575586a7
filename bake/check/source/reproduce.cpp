// Bakes again, as differently as a process can.
#include "bake/check/source/reproduce.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <system_error>

#include "bake/process/process.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> trouble(const std::string& cause) {
  return fail(ExitCode::kIo, "bake.reproduce", "--prove-reproducible", cause,
              "make room for temporary files, and give models and patterns by files");
}

/// Options that tell where things go or how much is said: the second bake has its own.
bool taken_out(const std::string& word, bool& with_value) {
  for (const char* flag : {"--prove-reproducible", "--json", "--quiet"}) {
    if (word == flag) return true;
  }
  for (const std::string option : {"--output", "--jobs", "--texture-pictures"}) {
    with_value = word == option;
    if (with_value || word.starts_with(option + "=")) return true;
  }
  with_value = word == "-o";
  return word.starts_with("-o");
}

/// The same files by other paths: each folder gets a link of another name.
class OtherPaths {
 public:
  explicit OtherPaths(const std::string& folder) : folder_(folder) {}

  /// False where no link can be made.
  bool add(const std::string& path) {
    std::error_code error;
    const fs::path whole = fs::absolute(path, error);
    const fs::path link = fs::path(folder_) / ("elsewhere " + std::to_string(paths_.size()));
    if (!error) fs::create_directory_symlink(whole.parent_path(), link, error);
    paths_[path] = (link / whole.filename()).string();
    return !error;
  }

  /// A word of the command line, with its file's other path.
  [[nodiscard]] std::string of(const std::string& word) const {
    for (const auto& [path, other] : paths_) {
      if (word == path) return other;
      if (word.starts_with(path + ":")) return other + word.substr(path.size());
      if (const std::size_t at = word.find("=" + path); at != std::string::npos) {
        return word.substr(0, at + 1) + other + word.substr(at + 1 + path.size());
      }
    }
    return word;
  }

 private:
  std::string folder_;
  std::map<std::string, std::string> paths_;
};

std::vector<std::string> second_command(const BakeRequest& request,
                                        const std::vector<std::string>& words,
                                        const OtherPaths& paths, const std::string& output) {
  std::vector<std::string> command = {program_folder() + "/modar"};
  for (std::size_t i = 0; i < words.size(); ++i) {
    bool with_value = false;
    if (taken_out(words[i], with_value)) {
      if (with_value) ++i;
      continue;
    }
    command.push_back(paths.of(words[i]));
  }
  const unsigned jobs = request.jobs == 1 ? 3 : 1;
  command.insert(command.end(), {"--quiet", "--jobs", std::to_string(jobs), "-o", output});
  return command;
}

/// What a program may stumble over. PATH and the loader's variables stay.
std::vector<std::string> second_environment(const std::string& folder) {
  std::vector<std::string> list = {
      "LC_ALL=tr_TR.UTF-8", "LANG=de_DE.UTF-8", "LANGUAGE=tr", "TZ=Pacific/Kiritimati",
      "HOME=" + folder,     "USER=somebody",    "COLUMNS=13",  "SOURCE_DATE_EPOCH=1"};
  for (const char* kept : {"PATH", "LD_LIBRARY_PATH", "LSAN_OPTIONS", "ASAN_OPTIONS", "TMPDIR"}) {
    if (const char* value = std::getenv(kept); value != nullptr) {
      list.push_back(std::string(kept) + "=" + value);
    }
  }
  return list;
}

}  // namespace

Result<void> prove_reproducible(const BakeRequest& request, const std::vector<std::string>& words,
                                std::span<const std::byte> baked) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return trouble("there is no space for temporary files");
  OtherPaths paths(folder.path());
  bool linked = true;
  for (const ModelRequest& model : request.models) linked = paths.add(model.path) && linked;
  for (const PatternRequest& pattern : request.patterns) linked = paths.add(pattern.path) && linked;
  if (!linked) return trouble("the input's folders cannot be linked to");

  ProcessRequest process;
  const std::string output = folder.path() + "/again.modar";
  process.words = second_command(request, words, paths, output);
  process.environment = second_environment(folder.path());
  if (const int code = run_process(process); code != 0) {
    return trouble("the second bake ended with code " + std::to_string(code));
  }
  MODAR_ASSIGN(const MappedFile again, MappedFile::open(output));
  const std::span<const std::byte> bytes = again.bytes();
  const auto [a, b] = std::mismatch(baked.begin(), baked.end(), bytes.begin(), bytes.end());
  if (a == baked.end() && b == bytes.end()) return {};
  return fail(ExitCode::kInternal, "bake.not-reproducible",
              "byte " + std::to_string(a - baked.begin()),
              with_numbers("a second bake under other circumstances gave {} bytes that differ from "
                           "the {} of the first",
                           {bytes.size(), baked.size()}),
              "internal error: please report it with the input");
}

}  // namespace modar
