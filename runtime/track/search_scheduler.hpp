// When the frames are searched, and for which patterns: on the caller's thread, on one of its own,
// or in slices within a budget. Internal to runtime/track.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "frame_tracker.hpp"
#include "modar/pose_loop.hpp"
#include "pattern_search.hpp"

namespace modar::tracker {

class SearchScheduler {
 public:
  /// Searches the prints among the patterns, with a copy of them and of the camera: see
  /// set_shapes().
  SearchScheduler(const Camera& camera, std::span<const TrackedPattern> patterns,
                  const PoseLoopOptions& options);

  /// Candidates of a search on a thread of its own that has ended; false: none, or it started
  /// before reset().
  bool take();
  /// Continues a sliced search within the rest of the frame's budget. True where there are
  /// candidates. tracked: patterns, of which extended tracking counts as one.
  bool advance(std::ptrdiff_t tracked);
  /// Whether this frame is searched for the patterns that are not tracked; sets their priorities.
  /// following: extended tracking says where one of them is.
  bool due(std::span<const TrackedPattern> patterns, std::span<const Track> tracks, bool following);
  /// Searches the frame, or starts to. True where there are candidates at once. known: copies that
  /// are tracked, of prints of several copies.
  bool start(const GrayImage& frame, FeatureExtractor& extractor, std::span<const KnownCopy> known);
  /// After a find: among many patterns, the next frame is searched again for more.
  void found() {
    if (patterns_.size() >= kMany) frames_to_search_ = 0;
  }
  /// Forgets the search under way.
  void reset();

  /// aspect(i): of the flat pattern i. Taken over unless a search is under way, which reads them.
  template <class Aspect>
  void set_shapes(const Camera& camera, const Aspect& aspect) {
    if (!idle()) return;
    for (std::size_t i = 0; i < patterns_.size(); ++i) {
      patterns_[i].shape[1][1] = patterns_[i].surface.flat() ? aspect(i) : 1.0;
    }
    camera_ = camera;
  }

  [[nodiscard]] const DetectionCandidates& candidates() const { return candidates_; }
  /// Whether the candidates are of a search for this pattern.
  [[nodiscard]] bool searched(std::size_t i) const {
    return priorities_[i] != SearchPriority::kNone;
  }
  /// Whether candidates are of an earlier frame.
  [[nodiscard]] bool late() const { return async_ != nullptr || sliced_ != nullptr; }
  /// Whether finds are refined, verified and shown in the frame that completes the search.
  [[nodiscard]] bool verifies_finds() const;

 private:
  [[nodiscard]] bool idle() const;

  PoseLoopOptions options_;
  Camera camera_;
  std::vector<TrackedPattern> patterns_;
  std::vector<SearchPriority> priorities_;
  DetectionCandidates candidates_;
  std::unique_ptr<PatternSearch> search_;   ///< searches on the caller's thread,
  std::unique_ptr<AsyncDetector> async_;    ///< on a separate thread,
  std::unique_ptr<SlicedDetector> sliced_;  ///< or in slices within the budget
  int frames_to_search_ = 0;
  bool discard_found_ = false;  ///< the running search started before a reset
};

}  // namespace modar::tracker
