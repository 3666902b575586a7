// Hands items from one thread to another: the newest one (live cameras) or each in order (files).
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "runtime/platform/semaphore.hpp"

namespace modar {

enum class Delivery : std::uint8_t {
  kNewest,   ///< one slot; a post replaces what was not taken yet; post never waits
  kInOrder,  ///< two slots; a post waits for a free one; nothing is dropped
};

/// One thread posts, one takes; any thread closes, as often as it likes. Items are swapped in and
/// out, so that their buffers circulate between the two sides and nothing is copied. The guard is
/// held for that swap only. T: movable, default constructed is empty.
template <class T>
class Mailbox {
 public:
  explicit Mailbox(Delivery delivery)
      : delivery_(delivery), free_(delivery == Delivery::kInOrder ? kSlots : 0) {}

  /// Swaps `item` in; it holds a used or empty one afterwards. Answers false once closed: then the
  /// item stays with the caller.
  bool post(T& item) {
    if (delivery_ == Delivery::kInOrder) free_.acquire();
    guard_.acquire();
    if (closed_) {
      guard_.release();
      free_.release();  // whoever posts after this one must not wait either
      return false;
    }
    bool fresh = true;
    if (delivery_ == Delivery::kNewest && count_ == 1) {
      std::swap(slots_[first_], item);
      ++dropped_;
      fresh = false;
    } else {
      std::swap(slots_[(first_ + count_) % kSlots], item);
      ++count_;
    }
    guard_.release();
    if (fresh) ready_.release();
    return true;
  }

  /// Waits for an item and swaps it out. Answers false once closed and empty.
  bool take(T& item) {
    ready_.acquire();
    return take_ready(item);
  }

  enum class Taken : std::uint8_t { kItem, kNothingYet, kClosed };
  /// The same, but waits for at most `limit`.
  Taken take_for(T& item, std::chrono::nanoseconds limit) {
    if (!ready_.acquire_for(limit)) return Taken::kNothingYet;
    return take_ready(item) ? Taken::kItem : Taken::kClosed;
  }

  /// No more posts; what was posted can still be taken. Wakes both sides.
  void close() {
    guard_.acquire();
    closed_ = true;
    guard_.release();
    ready_.release();
    free_.release();
  }

  /// Items that were replaced before they were taken.
  [[nodiscard]] std::uint64_t dropped() {
    guard_.acquire();
    const std::uint64_t dropped = dropped_;
    guard_.release();
    return dropped;
  }

 private:
  static constexpr std::size_t kSlots = 2;

  bool take_ready(T& item) {
    guard_.acquire();
    if (count_ == 0) {  // only close() signals without an item
      guard_.release();
      ready_.release();  // for whoever takes after this one
      return false;
    }
    std::swap(slots_[first_], item);
    first_ = (first_ + 1) % kSlots;
    --count_;
    guard_.release();
    if (delivery_ == Delivery::kInOrder) free_.release();
    return true;
  }

  const Delivery delivery_;
  Semaphore guard_{1};
  Semaphore ready_{0};  ///< counts items, and one more for each close()
  Semaphore free_;      ///< counts free slots (in order only)
  std::array<T, kSlots> slots_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::uint64_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace modar
