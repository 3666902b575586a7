// The search for patterns in one frame, wherever they are: on the caller's thread, or on a thread
// of its own. Internal to runtime/track.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "modar/tracker.hpp"
#include "modar/tracker_features.hpp"
#include "pattern_matching.hpp"
#include "pose_refinement.hpp"
#include "reason_evidence.hpp"
#include "runtime/platform/semaphore.hpp"

namespace modar::tracker {

/// Whether a pattern is searched for, and how urgently.
enum class SearchPriority : std::uint8_t {
  kNone,
  kNormal,
  kFirst,  ///< it was lost a moment ago
};

/// Percentage of the cells that must correlate where kClosePatches speak for a place: with 20,
/// strips of a seventh gave poses 200 pixels off.
inline constexpr int kClosePatchesPercent = 25;

/// What a search found of one pattern.
struct DetectionCandidate {
  Reason reason = Reason::kNoFeatures;
  Pose pose;                     ///< if kVisible
  bool homography_only = false;  ///< no pose explains the frame, but `map` does; `pose` is nearest
  PlaneMap map;                  ///< if homography_only
  bool inconsistent = false;     ///< see PatchFit::inconsistent()
  int matches = 0;
  int inliers = 0;
  LikelyPlace place;  ///< if not kVisible, of a flat pattern
};

/// A copy of a print whose place is known: a search leaves out what it explains.
struct KnownCopy {
  std::uint32_t pattern = 0;
  PlaneMap map;  ///< to undistorted frame pixels
};

struct DetectionCandidates {
  std::vector<DetectionCandidate> patterns;  ///< unchanged where the priority was kNone
  /// Further copies, with their patterns. In `patterns` there is the one that was tried last.
  std::vector<std::pair<std::uint32_t, DetectionCandidate>> copies;
  std::int32_t crowded = -1;  ///< TrackResult::crowded
  int features = 0;
  TrackTimes times;  ///< detect, match and homography
};

/// Extracts the frame's features once. If many patterns are searched for, an index over all of them
/// selects the few to match in full; if none of those is found, one of the others has its turn.
class PatternSearch {
 public:
  /// The patterns must outlive it. With more than a few of them, prepare() or the first run()
  /// builds the index. known_camera: what a guessed one does not explain looks as if patches
  /// contradicted each other, and hides nothing.
  PatternSearch(const Camera& camera, std::span<const TrackedPattern> patterns,
                const DetectOptions& options, bool known_camera);
  /// extractor: holds the frame. priorities: one per pattern. known: copies that are tracked, of
  /// patterns of several copies. Allocates nothing after the first call.
  void run(FeatureExtractor& extractor, std::span<const SearchPriority> priorities,
           std::span<const KnownCopy> known, DetectionCandidates& candidates);
  /// The same in slices: prepare() and advance() until they return true, begin() between them. The
  /// arguments must stay until then. work: about how many ARMv7 instructions advance() may take;
  /// the first step of a call is always taken, and none is interrupted: the longest takes some 5
  /// million.
  bool prepare(std::int64_t work);
  void begin(FeatureExtractor& extractor, std::span<const SearchPriority> priorities,
             std::span<const KnownCopy> known, DetectionCandidates& candidates);
  bool advance(std::int64_t work);

 private:
  void select(std::span<const TrackerFeature> features, std::span<const SearchPriority> priorities);
  /// Whether the index alone says which patterns are matched.
  [[nodiscard]] bool many() const;
  /// Whether a search among many has cost as much as a frame may.
  [[nodiscard]] bool exhausted() const;
  void select_places(std::span<const TrackerFeature> features);
  std::span<const TrackerFeature> features_there(const TrackedPattern& pattern, std::size_t& count);
  /// What advance() does next.
  enum class Stage : std::uint8_t {
    kFeatures,
    kSelect,
    kMatch,
    kVote,
    kHypotheses,
    kStart,
    kRefine,
    kMap
  };
  /// The features that are matched: every second of the frame's, all, the spare ones as well.
  enum class Features : std::uint8_t { kHalf, kAll, kSpare };
  bool step(std::int64_t& work);
  bool take_features(std::int64_t& work);
  void match_features(const TrackedPattern& pattern, std::int64_t& work);
  void begin_vote();
  void take_hypotheses();
  void start_hypothesis(const TrackedPattern& pattern, const FrameView& frame);
  void after_start();
  void conclude(const TrackedPattern& pattern, const FrameView& frame);
  bool search_next_copy(const TrackedPattern& pattern, const FrameView& frame);
  [[nodiscard]] bool shows_another(const TrackedPattern& pattern, const FrameView& frame) const;
  void note_place(const TrackedPattern& pattern);
  void next_hypothesis();
  [[nodiscard]] std::int64_t cost_of_step() const;
  /// A refined pose and the evidence for it.
  struct PoseCandidate {
    Pose pose;
    int percent = 0;            ///< of the textured cells in view that correlate
    int score = 0;              ///< ranks candidates
    bool refined = false;       ///< the patches fit,
    bool finest = false;        ///< on the finest level,
    bool unoccluded = false;    ///< most of them,
    bool complete = false;      ///< nearly all
    bool few = false;           ///< less than a fifth of them
    bool close = false;         ///< kClosePatches closely
    bool inconsistent = false;  ///< they contradict each other
  };
  [[nodiscard]] PoseCandidate evaluate_start(const TrackedPattern& pattern, const FrameView& frame,
                                             SearchRadius radius, const Pose& start) const;
  [[nodiscard]] PoseCandidate refine_start(const TrackedPattern& pattern, const FrameView& frame,
                                           Pose start) const;
  [[nodiscard]] PoseCandidate ask_other_faces(const TrackedPattern& pattern, const FrameView& frame,
                                              const PoseCandidate& one) const;
  /// Whether the features of the hypothesis speak for it by themselves.
  [[nodiscard]] bool has_enough_inliers() const;
  [[nodiscard]] bool bent(const TrackedPattern& pattern) const;
  bool passes_verification(const TrackedPattern& pattern, const FrameView& frame,
                           const PoseCandidate& one) const;
  void consider(const TrackedPattern& pattern, const FrameView& frame, const PoseCandidate& one);
  [[nodiscard]] bool likely(std::size_t start) const;
  void fit_starts(const TrackedPattern& pattern, const FrameView& frame);
  void find_map(const TrackedPattern& pattern, const FrameView& frame,
                const HomographyHypothesis& hypothesis, int min_percent,
                DetectionCandidate& candidate) const;

  const Camera& camera_;
  const bool known_camera_;
  const Kernels& kernels_;
  std::span<const TrackedPattern> patterns_;
  PatchCache patches_;
  PlaneMatcher matcher_;
  std::unique_ptr<CodeIndex> index_;
  bool ready_ = false;  ///< the index, if there is one
  std::vector<std::uint32_t> selected_;
  std::vector<std::uint8_t> has_votes_;  ///< by pattern
  std::vector<std::uint8_t> failures_;   ///< by pattern: its recent places that failed
  std::vector<TrackerFeature> near_;     ///< in the place that the index gave the pattern
  std::size_t likely_ = 0;               ///< the first of selected_, which are always matched
  std::uint32_t turn_ = 0;               ///< the pattern whose turn is next
  std::vector<KnownCopy> known_;         ///< those of the caller, and those found

  // Of the search under way:
  FeatureExtractor* extractor_ = nullptr;
  std::span<const SearchPriority> priorities_;
  DetectionCandidates* candidates_ = nullptr;
  Stage stage_ = Stage::kFeatures;
  std::int64_t spent_ = 0;        ///< instructions
  std::size_t at_ = 0;            ///< of selected_
  bool found_ = false;            ///< one of them
  std::size_t next_feature_ = 0;  ///< to match
  Features features_ = Features::kHalf;
  std::span<const HomographyHypothesis> hypotheses_;
  std::size_t hypothesis_ = 0;
  std::size_t best_hypothesis_ = 0;  ///< whose pose is best_
  std::array<Pose, 2> starts_;       ///< of the hypothesis
  std::size_t start_ = 0;
  std::size_t start_count_ = 0;
  double least_rms_ = 0;  ///< of starts_[0]
  bool decided_ = true;   ///< which of two mirror images it is
  PoseCandidate best_;
  LikelyPlace place_;
  SmallVotes small_;
  int missed_ = 0;  ///< patterns not found so far
};

/// A search of its own copy of a frame.
struct FrameSearch {
  FrameSearch(const Camera& camera, std::span<const TrackedPattern> patterns,
              const DetectOptions& options, bool known_camera);
  void set(const GrayImage& caller_frame, std::span<const SearchPriority> caller_priorities,
           std::span<const KnownCopy> caller_known);

  std::unique_ptr<FeatureExtractor> extractor;
  PatternSearch search;
  GrayImage frame;
  std::vector<std::uint8_t> pixels;
  std::vector<SearchPriority> priorities;
  std::vector<KnownCopy> known;
  DetectionCandidates found;
};

/// Runs a PatternSearch in slices between other work of the caller's.
class SlicedDetector {
 public:
  /// The patterns must outlive it.
  SlicedDetector(const Camera& camera, std::span<const TrackedPattern> patterns,
                 const DetectOptions& options, bool known_camera)
      : job_(camera, patterns, options, known_camera) {}
  /// False while it searches, and before the first search.
  [[nodiscard]] bool idle() const { return prepared_ && !busy_; }
  /// Starts a search; only if idle().
  void start(const GrayImage& frame, std::span<const SearchPriority> priorities,
             std::span<const KnownCopy> known);
  /// Continues it (PatternSearch::advance), or prepares for the first. In the call after the one
  /// that finished it, swaps out candidates and priorities, and returns true.
  bool advance(std::int64_t work, DetectionCandidates& candidates,
               std::vector<SearchPriority>& priorities);
  /// Forgets the search under way.
  void cancel() { busy_ = finished_ = false; }

 private:
  FrameSearch job_;
  bool prepared_ = false;
  bool busy_ = false;
  bool finished_ = false;
};

/// Runs a PatternSearch on a thread of its own, one frame at a time: on a copy, so that the
/// caller's may change at once. start() and take() belong to one thread; neither waits.
class AsyncDetector {
 public:
  /// The patterns must outlive it.
  AsyncDetector(const Camera& camera, std::span<const TrackedPattern> patterns,
                const DetectOptions& options, bool known_camera);
  AsyncDetector(const AsyncDetector&) = delete;
  AsyncDetector& operator=(const AsyncDetector&) = delete;
  /// Waits for a running search to end.
  ~AsyncDetector();

  /// False while a search runs or its candidates have not been taken.
  [[nodiscard]] bool idle() const { return stage_.load(std::memory_order_acquire) == Stage::kIdle; }
  /// Starts a search; only if idle(). priorities: one per pattern.
  void start(const GrayImage& frame, std::span<const SearchPriority> priorities,
             std::span<const KnownCopy> known);
  /// Swaps out the candidates and priorities of a finished search; false if none exists.
  bool take(DetectionCandidates& candidates, std::vector<SearchPriority>& priorities);

 private:
  enum class Stage : std::uint8_t { kIdle, kSearching, kFound };
  void work();

  FrameSearch job_;
  std::atomic<Stage> stage_{Stage::kIdle};  ///< kSearching: the fields above belong to thread_
  std::atomic<bool> closing_{false};
  Semaphore wake_{0};
  std::thread thread_;
};

}  // namespace modar::tracker
