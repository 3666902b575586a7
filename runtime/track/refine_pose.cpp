// Alignment from coarse to fine, and the checks of what it arrives at.
#include "refine_pose.hpp"

#include <algorithm>

namespace modar::tracker {
namespace {

constexpr int kMapPercent = 50;      // where no pose fits, and the map alone must convince
constexpr double kSmallSide = 24.0;  // pixels of the coarsest level that tracking starts on
constexpr double kMostZoom = 1.35;   // of the distance, from one frame to the next
constexpr double kFalling = 0.85;    // of the share of patches that a coarser level holds

/// The level to start on: at most `most` above the finest.
int coarsest_level(const TrackedPattern& pattern, const Resolution& best, int levels, int most) {
  int coarsest = best.frame_level;
  double side =
      std::max(pattern.width(), pattern.height()) / static_cast<double>(1 << best.pattern_level);
  while (coarsest + 1 < levels && coarsest - best.frame_level < most && side > 2 * kSmallSide &&
         best.pattern_level + coarsest + 1 - best.frame_level < pattern.level_count) {
    ++coarsest;
    side *= 0.5;
  }
  return coarsest;
}

}  // namespace

bool settle(const TrackedPattern& pattern, const Scene& scene, Reach reach, Pose& pose, Fit& fit) {
  const bool far = reach == Reach::kFar;
  const int levels = static_cast<int>(scene.pyramid.size());
  const Resolution best = finest(pattern, map_of_pose(pattern, scene.camera, pose), levels);
  const int coarsest = coarsest_level(pattern, best, levels,
                                      far                      ? 4
                                      : reach == Reach::kFrame ? 2
                                                               : 0);
  const double depth = pose.translation.z;
  Pose held = pose;
  bool found = false;
  for (int level = coarsest; level >= best.frame_level; --level) {
    Pose next = pose;
    const Fit now = align(pattern, scene, level, 10, level == best.frame_level, next);
    const double zoom = next.translation.z / depth;
    if (!(zoom < kMostZoom && zoom * kMostZoom > 1.0)) return false;
    // Under blur fine patches hold along the motion only, and pull away from what coarse ones say.
    if (now.good() && (!found || now.share() >= kFalling * fit.share())) {
      held = pose = next;
      fit = now;
      found = true;
      continue;
    }
    // Blur takes the fine levels first: what a coarser one held stays.
    if (found) break;
    pose = next;
  }
  pose = held;
  if (!found || fit.level == best.frame_level) return found;
  return percent_right(pattern, scene, pose) >= kRightPercent;
}

int percent_right(const TrackedPattern& pattern, const Scene& scene, const Pose& pose,
                  int fewest_cells) {
  const Verdict verdict = verify(pattern, map_of_pose(pattern, scene.camera, pose), scene.pyramid);
  return verdict.right >= fewest_cells ? verdict.right * 100 / verdict.cells : 0;
}

bool settle_map(const TrackedPattern& pattern, const Scene& scene, PlaneMap& map, Fit& fit) {
  const int levels = static_cast<int>(scene.pyramid.size());
  const Resolution best = finest(pattern, map, levels);
  for (int level = coarsest_level(pattern, best, levels, 2); level >= best.frame_level; --level) {
    fit = align_map(pattern, scene, level, 4, map);
  }
  return fit.good() && map_percent(pattern, scene, map) > 0;
}

int map_percent(const TrackedPattern& pattern, const Scene& scene, const PlaneMap& map) {
  const Verdict verdict = verify(pattern, map, scene.pyramid);
  if (verdict.right < 2 * kRightCells) return 0;
  const int percent = verdict.right * 100 / verdict.cells;
  return percent >= kMapPercent ? percent : 0;
}

}  // namespace modar::tracker
