// Looks for patterns in a single frame, wherever they are. Internal to runtime/track.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "code_index.hpp"
#include "modar/loop_features.hpp"
#include "modar/tracker.hpp"
#include "plane_matcher.hpp"
#include "plane_settle.hpp"

namespace modar::loop {

/// How much a pattern is asked for.
enum class Want : std::uint8_t {
  kNo,
  kYes,
  kFirst,  ///< it was there a moment ago
};

/// What a search says of one pattern.
struct Finding {
  Reason reason = Reason::kNoFeatures;
  Pose pose;            ///< where the reason is kVisible
  bool by_map = false;  ///< no pose explains the picture, but the map does: the pose is the nearest
  PlaneMap map;         ///< where by_map
  int matches = 0;
  int inliers = 0;
};

struct Findings {
  std::vector<Finding> patterns;  ///< of those that were not wanted: untouched
  int features = 0;
  TrackTimes times;  ///< detect, match and homography
};

/// Features of the frame are found once. Where many patterns are wanted, an index over all of them
/// tells which few are worth matching in full; where none of those is there, one of the others has
/// its turn.
class PatternSearch {
 public:
  /// The patterns must outlive it. With more than a few of them, the first run() builds the index.
  PatternSearch(const Camera& camera, std::span<const LoopPattern> patterns,
                const LoopDetectOptions& options);
  /// eye: holds the frame. wants: one a pattern. Allocates nothing after the first call.
  void run(LoopDescriber& eye, std::span<const Want> wants, Findings& findings);

 private:
  void choose(std::span<const LoopFeature> features, std::span<const Want> wants);
  Finding find(const LoopPattern& pattern, const Scene& scene,
               std::span<const LoopFeature> features, TrackTimes& times);
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
  [[nodiscard]] Place settled(const LoopPattern& pattern, const Scene& scene, Reach reach,
                              const Pose& start) const;
  [[nodiscard]] Place bring(const LoopPattern& pattern, const Scene& scene, Pose start) const;
  void find_pose(const LoopPattern& pattern, const Scene& scene, const PlaneFind& found,
                 Place& best, Finding& finding);
  void find_map(const LoopPattern& pattern, const Scene& scene, const PlaneFind& found, int better,
                Finding& finding) const;

  Camera camera_;
  const Kernels& kernels_;
  std::span<const LoopPattern> patterns_;
  PatchCache patches_;
  PlaneMatcher matcher_;
  std::unique_ptr<CodeIndex> index_;
  std::vector<std::uint32_t> chosen_;
  std::vector<std::uint8_t> is_clear_;  ///< by pattern
  std::size_t clear_ = 0;               ///< the first of them, which are matched whatever is found
  std::uint32_t turn_ = 0;              ///< the pattern whose turn is next
};

}  // namespace modar::loop
