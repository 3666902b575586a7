// The search for patterns in one frame, wherever they are: on the caller's thread, or on a thread
// of its own. Internal to runtime/track.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "modar/tracker.hpp"
#include "modar/tracker_features.hpp"
#include "pattern_matching.hpp"
#include "pose_refinement.hpp"
#include "runtime/platform/semaphore.hpp"

namespace modar::tracker {

/// Whether a pattern is searched for, and how urgently.
enum class SearchPriority : std::uint8_t {
  kNone,
  kNormal,
  kFirst,  ///< it was lost a moment ago
};

/// What a search found of one pattern.
struct DetectionCandidate {
  Reason reason = Reason::kNoFeatures;
  Pose pose;                     ///< if kVisible
  bool homography_only = false;  ///< no pose explains the frame, but `map` does; `pose` is nearest
  PlaneMap map;                  ///< if homography_only
  int matches = 0;
  int inliers = 0;
};

struct DetectionCandidates {
  std::vector<DetectionCandidate> patterns;  ///< unchanged where the priority was kNone
  int features = 0;
  TrackTimes times;  ///< detect, match and homography
};

/// Extracts the frame's features once. If many patterns are searched for, an index over all of them
/// selects the few to match in full; if none of those is found, one of the others has its turn.
class PatternSearch {
 public:
  /// The patterns must outlive it. With more than a few of them, the first run() builds the index.
  PatternSearch(const Camera& camera, std::span<const TrackedPattern> patterns,
                const DetectOptions& options);
  /// extractor: holds the frame. priorities: one per pattern. Allocates nothing after the first
  /// call.
  void run(FeatureExtractor& extractor, std::span<const SearchPriority> priorities,
           DetectionCandidates& candidates);

 private:
  void select(std::span<const TrackerFeature> features, std::span<const SearchPriority> priorities);
  DetectionCandidate find(const TrackedPattern& pattern, const FrameView& frame,
                          std::span<const TrackerFeature> features, TrackTimes& times);
  /// A refined pose and the evidence for it.
  struct PoseCandidate {
    Pose pose;
    int percent = 0;          ///< of the textured cells in view that correlate
    int score = 0;            ///< ranks candidates
    bool refined = false;     ///< the patches fit,
    bool finest = false;      ///< on the finest level,
    bool unoccluded = false;  ///< most of them,
    bool complete = false;    ///< nearly all
  };
  [[nodiscard]] PoseCandidate evaluate_start(const TrackedPattern& pattern, const FrameView& frame,
                                             SearchRadius radius, const Pose& start) const;
  [[nodiscard]] PoseCandidate refine_start(const TrackedPattern& pattern, const FrameView& frame,
                                           Pose start) const;
  void find_pose(const TrackedPattern& pattern, const FrameView& frame,
                 const HomographyHypothesis& hypothesis, PoseCandidate& best,
                 DetectionCandidate& candidate);
  void find_map(const TrackedPattern& pattern, const FrameView& frame,
                const HomographyHypothesis& hypothesis, int min_percent,
                DetectionCandidate& candidate) const;

  Camera camera_;
  const Kernels& kernels_;
  std::span<const TrackedPattern> patterns_;
  PatchCache patches_;
  PlaneMatcher matcher_;
  std::unique_ptr<CodeIndex> index_;
  std::vector<std::uint32_t> selected_;
  std::vector<std::uint8_t> has_votes_;  ///< by pattern
  std::size_t likely_ = 0;               ///< the first of selected_, which are always matched
  std::uint32_t turn_ = 0;               ///< the pattern whose turn is next
};

/// Runs a PatternSearch on a thread of its own, one frame at a time: on a copy, so that the
/// caller's may change at once. start() and take() belong to one thread; neither waits.
class AsyncDetector {
 public:
  /// The patterns must outlive it.
  AsyncDetector(const Camera& camera, std::span<const TrackedPattern> patterns,
                const DetectOptions& options);
  AsyncDetector(const AsyncDetector&) = delete;
  AsyncDetector& operator=(const AsyncDetector&) = delete;
  /// Waits for a running search to end.
  ~AsyncDetector();

  /// False while a search runs or its candidates have not been taken.
  [[nodiscard]] bool idle() const { return stage_.load(std::memory_order_acquire) == Stage::kIdle; }
  /// Starts a search; only if idle(). priorities: one per pattern.
  void start(const GrayImage& frame, std::span<const SearchPriority> priorities);
  /// Swaps out the candidates and priorities of a finished search; false if there is none.
  bool take(DetectionCandidates& candidates, std::vector<SearchPriority>& priorities);

 private:
  enum class Stage : std::uint8_t { kIdle, kSearching, kFound };
  void work();

  std::unique_ptr<FeatureExtractor> extractor_;
  PatternSearch search_;
  GrayImage frame_;
  std::vector<std::uint8_t> pixels_;
  std::vector<SearchPriority> priorities_;
  DetectionCandidates found_;
  std::atomic<Stage> stage_{Stage::kIdle};  ///< kSearching: the fields above belong to thread_
  std::atomic<bool> closing_{false};
  Semaphore wake_{0};
  std::thread thread_;
};

}  // namespace modar::tracker
