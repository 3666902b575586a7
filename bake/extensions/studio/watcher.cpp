#include "bake/extensions/studio/watcher.hpp"

#include <algorithm>
#include <chrono>

#include "bake/extensions/studio/folder_state.hpp"

namespace modar {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook(25);  // of which a change waits half; a sleep is as long
constexpr int kRest = 20;                       // times what a look took: 5 % of a core at most

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
  FolderState last = folder_state(folder_);
  auto rest = Clock::duration(kLook);
  for (auto next = Clock::now() + rest; !ended_;) {
    std::this_thread::sleep_for(kLook);
    if (Clock::now() < next) continue;
    const auto start = Clock::now();
    const FolderState now = folder_state(folder_);
    rest = std::max(Clock::duration(kLook), kRest * (Clock::now() - start));
    next = Clock::now() + rest;
    if (now.all != last.all) changed(now.sources != last.sources);
    last = now;
  }
}

}  // namespace modar
