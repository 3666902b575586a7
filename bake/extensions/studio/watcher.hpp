// Detects changes by other editors.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>

namespace modar {

/// Calls `changed` from a thread of its own when a file or folder below `folder` appears, goes or
/// is written, with whether one of them is neither modar.toml nor a bundle; hidden ones are not
/// looked at. A look costs a stat of each, and every next one waits
/// twenty times as long as it took.
class Watcher {
 public:
  Watcher(std::string folder, std::function<void(bool)> changed);
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;
  ~Watcher();

 private:
  void watch(const std::function<void(bool)>& changed);

  std::string folder_;
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace modar
