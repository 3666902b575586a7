// Recent results, kept up to a number of bytes.
#pragma once

#include <list>
#include <memory>
#include <mutex>
#include <string>

namespace modar {

/// Values by key, the most recently requested ones. Of all threads; a value in progress for one is
/// computed again for another that requests it meanwhile.
template <class T>
class Cache {
 public:
  explicit Cache(std::size_t most_bytes) : most_(most_bytes) {}

  /// Null if none.
  std::shared_ptr<const T> find(const std::string& key) {
    const std::lock_guard lock(mutex_);
    for (auto it = entries_.begin(); it != entries_.end(); ++it) {
      if (it->key != key) continue;
      entries_.splice(entries_.begin(), entries_, it);
      return entries_.front().value;
    }
    return nullptr;
  }

  std::shared_ptr<const T> add(const std::string& key, T value, std::size_t bytes) {
    auto shared = std::make_shared<const T>(std::move(value));
    const std::lock_guard lock(mutex_);
    entries_.push_front({key, shared, bytes});
    used_ += bytes;
    while (used_ > most_ && entries_.size() > 1) {
      used_ -= entries_.back().bytes;
      entries_.pop_back();
    }
    return shared;
  }

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<const T> value;
    std::size_t bytes;
  };
  std::mutex mutex_;
  std::list<Entry> entries_;
  std::size_t most_;
  std::size_t used_ = 0;
};

}  // namespace modar
