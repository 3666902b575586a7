// What happens, for all pages that listen.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "bake/json.hpp"

namespace modar {

struct Event {
  std::uint64_t number = 0;  ///< rising from 1
  std::string name;
  std::string data;  ///< JSON in one line
};

/// Keeps the last events, so that a page that was away for a moment misses none. Of all threads.
class Events {
 public:
  void publish(const std::string& name, const Json& data);
  /// Those after `number`, at once or when there are some or `most` has passed.
  std::vector<Event> wait(std::uint64_t number, std::chrono::milliseconds most);
  [[nodiscard]] std::uint64_t last() const;
  /// Nobody waits any more.
  void close();
  [[nodiscard]] bool closed() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Event> events_;
  std::uint64_t last_ = 0;
  bool closed_ = false;
};

}  // namespace modar
