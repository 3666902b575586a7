// Three threads a run: one reads frames, one looks for patterns, the caller's renders. Mailboxes
// join them; no lock is held while any of them works.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "formats/base/error.hpp"
#include "frame_source.hpp"
#include "modar/camera.hpp"
#include "modar/tracker.hpp"
#include "runtime/platform/semaphore.hpp"

namespace modar {

class WakeEvent {
 public:
  WakeEvent();
  WakeEvent(const WakeEvent&) = delete;
  WakeEvent& operator=(const WakeEvent&) = delete;
  ~WakeEvent();

  /// From any thread: each wait() answers kStopped from now on.
  void stop();

  enum class Event { kReadable, kStopped, kTimeout };
  /// descriptor: a file, pipe or device. Without a limit it waits for ever.
  [[nodiscard]] Event wait(int descriptor,
                           std::chrono::milliseconds limit = std::chrono::milliseconds(-1)) const;
  /// Only the stop: kStopped or kTimeout.
  [[nodiscard]] Event wait_for_stop(std::chrono::milliseconds limit) const;

 private:
  int event_ = -1;
};

enum class Delivery : std::uint8_t {
  kNewest,   ///< one slot; a post replaces one that was not taken yet; post never waits
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

  /// No more posts; the last post can still be taken. Wakes both sides.
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

struct LiveBundle;
struct SpotPattern;

/// What travels from thread to thread.
struct Job {
  Frame frame;
  Camera camera;  ///< of this frame's size
  TrackResult track;
  double track_ms = 0;
  std::shared_ptr<const SpotPattern> spot;  ///< the pattern of `track`; null: the bundle's patterns
  std::shared_ptr<const LiveBundle> live;   ///< that bundle; null: the one that was opened first
};

/// Runs on the vision thread: fills camera, track and track_ms.
using TrackStep = std::function<Result<void>(Job&)>;
/// Runs on the caller's thread. Answers false to end the run.
using ShowStep = std::function<Result<bool>(Job&)>;
/// Runs on the caller's thread while no frame comes, to keep a window alive. False ends the run.
using IdleStep = std::function<bool()>;

struct PipelineOptions {
  Delivery delivery = Delivery::kInOrder;
  bool paced = false;  ///< frames come no earlier than their time_s (a file played like a camera)
  IdleStep idle;       ///< may be empty
  std::chrono::milliseconds idle_every{20};
};

struct PipelineCounts {
  std::uint64_t dropped = 0;   ///< frames that a newer one replaced
  std::vector<Error> skipped;  ///< of pictures that cannot be read
};

/// Runs until the source ends, a step fails or the show step ends it; the threads are joined then.
/// Errors: the first one of reading, tracking, showing.
Result<PipelineCounts> run_pipeline(FrameSource& source, const TrackStep& track,
                                    const ShowStep& show, const PipelineOptions& options);

/// Milliseconds of the steady clock since `start_ns`, and that clock in nanoseconds.
std::int64_t now_ns();
double ms_since(std::int64_t start_ns);

}  // namespace modar
