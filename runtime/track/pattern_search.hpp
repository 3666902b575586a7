// Looks for patterns in a single frame, wherever they are. Internal to runtime/track.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "code_index.hpp"
#include "modar/tracker.hpp"
#include "modar/tracker_features.hpp"
#include "plane_matcher.hpp"
#include "refine_pose.hpp"

namespace modar::tracker {

/// How much a pattern is asked for.
enum class Want : std::uint8_t {
  kNo,
  kYes,
  kFirst,  ///< it was there a moment ago
};

/// What a search says of one pattern.
struct DetectionCandidate {
  Reason reason = Reason::kNoFeatures;
  Pose pose;            ///< where the reason is kVisible
  bool by_map = false;  ///< no pose explains the picture, but the map does: the pose is the nearest
  PlaneMap map;         ///< where by_map
  int matches = 0;
  int inliers = 0;
};

struct DetectionCandidates {
  std::vector<DetectionCandidate> patterns;  ///< of those that were not wanted: untouched
  int features = 0;
  TrackTimes times;  ///< detect, match and homography
};

/// Features of the frame are found once. Where many patterns are wanted, an index over all of them
/// tells which few are worth matching in full; where none of those is there, one of the others has
/// its turn.
class PatternSearch {
 public:
  /// The patterns must outlive it. With more than a few of them, the first run() builds the index.
  PatternSearch(const Camera& camera, std::span<const TrackedPattern> patterns,
                const DetectOptions& options);
  /// eye: holds the frame. wants: one a pattern. Allocates nothing after the first call.
  void run(FeatureExtractor& eye, std::span<const Want> wants, DetectionCandidates& candidates);

 private:
  void choose(std::span<const TrackerFeature> features, std::span<const Want> wants);
  DetectionCandidate find(const TrackedPattern& pattern, const Scene& scene,
                          std::span<const TrackerFeature> features, TrackTimes& times);
  /// Where a start leads to.
  struct Place {
    Pose pose;
    int right = 0;         ///< percent
    int value = 0;         ///< what speaks for it
    bool settled = false;  ///< the patches hold,
    bool fine = false;     ///< on the finest level,
    bool whole = false;    ///< most of them,
    bool all = false;      ///< nearly all
  };
  [[nodiscard]] Place settled(const TrackedPattern& pattern, const Scene& scene, Reach reach,
                              const Pose& start) const;
  [[nodiscard]] Place bring(const TrackedPattern& pattern, const Scene& scene, Pose start) const;
  void find_pose(const TrackedPattern& pattern, const Scene& scene, const PlaneFind& found,
                 Place& best, DetectionCandidate& candidate);
  void find_map(const TrackedPattern& pattern, const Scene& scene, const PlaneFind& found,
                int better, DetectionCandidate& candidate) const;

  Camera camera_;
  const Kernels& kernels_;
  std::span<const TrackedPattern> patterns_;
  PatchCache patches_;
  PlaneMatcher matcher_;
  std::unique_ptr<CodeIndex> index_;
  std::vector<std::uint32_t> chosen_;
  std::vector<std::uint8_t> is_clear_;  ///< by pattern
  std::size_t clear_ = 0;               ///< the first of them, which are matched whatever is found
  std::uint32_t turn_ = 0;              ///< the pattern whose turn is next
};

}  // namespace modar::tracker
