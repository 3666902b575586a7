#include "bake/extensions/studio/folder_state.hpp"

#include <sys/stat.h>

#include <filesystem>

#include "bake/project/project.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostWatched = 100'000;  // files that are looked at

}  // namespace

FolderState folder_state(const std::string& folder) {
  FolderState state;
  std::error_code error;
  std::size_t seen = 0;
  fs::recursive_directory_iterator it(folder, error);
  for (; !error && it != fs::recursive_directory_iterator() && ++seen < kMostWatched;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.starts_with('.') || name.ends_with(".tmp")) {
      it.disable_recursion_pending();
      continue;
    }
    struct stat status {};
    if (::lstat(it->path().c_str(), &status) != 0 || S_ISDIR(status.st_mode)) continue;
    const bool source = name != kProjectFile && !name.ends_with(".modar");
    const auto add = [&state, source](std::uint64_t value) {
      for (std::uint64_t* hash : {&state.all, source ? &state.sources : nullptr}) {
        if (hash != nullptr) *hash = (*hash ^ value) * 1099511628211U;
      }
    };
    for (const char c : it->path().native()) add(static_cast<unsigned char>(c));
    add(static_cast<std::uint64_t>(status.st_size));
    add(static_cast<std::uint64_t>(status.st_mtim.tv_sec));
    add(static_cast<std::uint64_t>(status.st_mtim.tv_nsec));
  }
  return state;
}

}  // namespace modar
