// The search for patterns on a thread of its own, so that no frame waits for it. Internal to
// runtime/track.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "pattern_search.hpp"
#include "runtime/platform/semaphore.hpp"

namespace modar::tracker {

/// Holds one frame at a time: a copy of the caller's, which may change at once. start() and take()
/// belong to one thread; neither waits.
class AsyncDetector {
 public:
  /// The patterns must outlive it.
  AsyncDetector(const Camera& camera, std::span<const TrackedPattern> patterns,
                const DetectOptions& options);
  AsyncDetector(const AsyncDetector&) = delete;
  AsyncDetector& operator=(const AsyncDetector&) = delete;
  /// Waits for a search that runs to end.
  ~AsyncDetector();

  /// False while a search runs or its candidates were not taken.
  [[nodiscard]] bool idle() const { return turn_.load(std::memory_order_acquire) == Turn::kIdle; }
  /// Begins a search; only where idle(). wants: one a pattern.
  void start(const GrayImage& frame, std::span<const Want> wants);
  /// Swaps the candidates and wants of a finished search out; false where there are none.
  bool take(DetectionCandidates& candidates, std::vector<Want>& wants);

 private:
  enum class Turn : std::uint8_t { kIdle, kSearching, kFound };
  void work();

  std::unique_ptr<FeatureExtractor> eye_;
  PatternSearch search_;
  GrayImage frame_;
  std::vector<std::uint8_t> pixels_;
  std::vector<Want> wants_;
  DetectionCandidates findings_;
  std::atomic<Turn> turn_{Turn::kIdle};  ///< says which thread may touch the fields above
  std::atomic<bool> closing_{false};
  Semaphore wake_{0};
  std::thread thread_;
};

}  // namespace modar::tracker
