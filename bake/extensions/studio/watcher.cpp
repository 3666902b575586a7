#include "bake/extensions/studio/watcher.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "bake/project/project.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook(25);  // of which a change waits half; a sleep is as long
constexpr int kRest = 20;                       // times what a look took: 5 % of a core at most
constexpr std::size_t kMostWatched = 100'000;   // that are looked at

/// Change with names, sizes and times: FNV-1a.
struct FolderState {
  std::uint64_t all = 14695981039346656037U;
  std::uint64_t sources = all;  ///< modar.toml and bundles left out
};

FolderState state_of(const std::string& folder) {
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

}  // namespace

Watcher::Watcher(std::string folder, std::function<void(bool)> changed)
    : folder_(std::move(folder)) {
  thread_ = std::thread([this, changed = std::move(changed)] { watch(changed); });
}

Watcher::~Watcher() {
  ended_ = true;
  thread_.join();
}

void Watcher::watch(const std::function<void(bool)>& changed) {
  FolderState last = state_of(folder_);
  auto rest = Clock::duration(kLook);
  for (auto next = Clock::now() + rest; !ended_;) {
    std::this_thread::sleep_for(kLook);
    if (Clock::now() < next) continue;
    const auto start = Clock::now();
    const FolderState now = state_of(folder_);
    rest = std::max(Clock::duration(kLook), kRest * (Clock::now() - start));
    next = Clock::now() + rest;
    if (now.all != last.all) changed(now.sources != last.sources);
    last = now;
  }
}

}  // namespace modar
