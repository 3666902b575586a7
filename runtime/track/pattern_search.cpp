// Features, which patterns to match, their homographies, poses and checks.
#include "pattern_search.hpp"

#include <algorithm>

#include <glm/matrix.hpp>

#include "refine_from_inliers.hpp"
#include "runtime/platform/lap_clock.hpp"

namespace modar::tracker {
namespace {

constexpr int kFewestInliers = 6;
constexpr int kFewestMatches = 6;
// Where the finest patches do not hold, which in clutter they never did:
constexpr int kVaguePercent = 60;     // so much must show,
constexpr int kVagueCells = 24;       // in so many cells: a few smooth ones look alike anywhere;
constexpr double kVagueMisfit = 3.0;  // and what the features then may leave
constexpr double kMostMisfit = 1.5;   // of what the features alone leave
constexpr double kMirrored = 1.5;     // the same, of two mirror images
constexpr double kFarMisfit = 3.0;    // where it is another place altogether
constexpr int kApartLoss = 8;         // what a place that features deny must show more
constexpr double kUnhidden = 0.85;    // share of patches that hold where nothing hides any
constexpr double kAll = 0.95;         // where the mirror image cannot be the right one
constexpr int kManyInliers = 16;      // features that speak for a place by themselves, so that
constexpr int kLeastPercent = 20;     // less of the pattern need show there
constexpr int kMapGain = 20;          // percent that the map shows more than the best pose
constexpr int kMapInliers = 16;       // where no pose fits, and the map alone must convince
// Of many patterns, those are matched in full
constexpr std::uint16_t kClearVotes = 4;  // that so many features speak for (chance: two or three),
constexpr int kShadowed = 6;              // and no fewer than this part of those for another there:
                                          // a shared frame or logo speaks for what it is not;
constexpr double kMargin = 0.25;          // of the pattern's size;
constexpr std::ptrdiff_t kMostClear = 4;  // at most so many a frame;
constexpr std::size_t kGuessed = 2;       // where none is found, these at least, by their votes,
constexpr std::size_t kMatched = 3;       // and with them the one whose turn it is.

std::size_t most_codes(std::span<const TrackedPattern> patterns) {
  std::size_t most = 0;
  for (const TrackedPattern& pattern : patterns) most = std::max(most, pattern.features.size());
  return most;
}

/// Whether a pattern lies where another one shows; with a margin, as one vote tells its outline.
bool covers(const TrackedPattern& pattern, const PlaneMatch& place, const PlaneMatch& other) {
  const glm::dvec2 size(pattern.width(), pattern.height());
  const glm::dvec2 at =
      (glm::inverse(place.affine) * (other.ideal - place.ideal) + place.pattern) / size;
  return std::min(at.x, at.y) > -kMargin && std::max(at.x, at.y) < 1.0 + kMargin;
}

}  // namespace

PatternSearch::PatternSearch(const Camera& camera, std::span<const TrackedPattern> patterns,
                             const DetectOptions& options)
    : camera_(camera),
      kernels_(kernels(options.simd)),
      patterns_(patterns),
      matcher_(camera, kernels_, static_cast<std::size_t>(options.max_features),
               most_codes(patterns)) {
  chosen_.reserve(patterns.size());
  is_clear_.resize(patterns.size());
}

/// Leaves in chosen_ the patterns to match in full; the first clear_ of them are likely there.
void PatternSearch::choose(std::span<const TrackerFeature> features, std::span<const Want> wants) {
  chosen_.clear();
  for (std::uint32_t i = 0; i < patterns_.size(); ++i) {
    if (wants[i] != Want::kNo) chosen_.push_back(i);
  }
  clear_ = chosen_.size();
  if (chosen_.size() <= kMatched) return;
  if (!index_) index_ = std::make_unique<CodeIndex>(patterns_, kernels_, matcher_.most_features());
  const std::span<const CodeIndex::Support> support = index_->vote(features);
  for (const std::uint32_t i : chosen_) {
    const CodeIndex::Support& one = support[i];
    is_clear_[i] = one.votes >= kClearVotes ? 1 : 0;
    for (std::size_t k = 0; k < support.size() && is_clear_[i] != 0; ++k) {
      const bool more = support[k].votes > kShadowed * one.votes;
      if (more && covers(patterns_[k], support[k].place, one.place)) is_clear_[i] = 0;
    }
  }
  const auto is_clear = [&](std::uint32_t i) { return is_clear_[i] != 0; };
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    if (is_clear(a) != is_clear(b)) return is_clear(a);
    if (wants[a] != wants[b]) return wants[a] == Want::kFirst;
    if (support[a].votes != support[b].votes) return support[a].votes > support[b].votes;
    return a < b;
  };
  const auto first = chosen_.begin();
  std::partial_sort(first, first + kMostClear, chosen_.end(), before);
  clear_ = static_cast<std::size_t>(std::find_if_not(first, first + kMostClear, is_clear) - first);
  const auto turn = first + static_cast<std::ptrdiff_t>(std::max(clear_, kGuessed));
  if (turn == chosen_.end()) return;
  const auto since = [this](std::uint32_t i) {
    const auto count = static_cast<std::uint32_t>(patterns_.size());
    return (i + count - turn_) % count;
  };
  const auto next = std::min_element(
      turn, chosen_.end(), [&](std::uint32_t a, std::uint32_t b) { return since(a) < since(b); });
  turn_ = (*next + 1) % static_cast<std::uint32_t>(patterns_.size());
  std::iter_swap(turn, next);
  chosen_.erase(turn + 1, chosen_.end());
}

void PatternSearch::run(FeatureExtractor& eye, std::span<const Want> wants,
                        DetectionCandidates& candidates) {
  LapClock clock;
  candidates.patterns.resize(patterns_.size());
  candidates.times = {};
  const auto features = eye.features();
  candidates.features = static_cast<int>(features.size());
  candidates.times.detect = clock.lap();
  for (std::size_t i = 0; i < patterns_.size(); ++i) {
    if (wants[i] == Want::kNo) continue;
    candidates.patterns[i] = {};
    // Those that the index does not choose have few matches, as far as it can tell.
    if (!features.empty()) candidates.patterns[i].reason = Reason::kFewMatches;
  }
  if (features.empty()) return;
  choose(features, wants);
  candidates.times.match = clock.lap();
  const Scene scene{camera_, eye.pyramid(), kernels_, patches_};
  bool found = false;
  for (std::size_t k = 0; k < chosen_.size() && (k < clear_ || !found); ++k) {
    DetectionCandidate& candidate = candidates.patterns[chosen_[k]];
    candidate = find(patterns_[chosen_[k]], scene, features, candidates.times);
    found = found || candidate.reason == Reason::kVisible;
  }
}

DetectionCandidate PatternSearch::find(const TrackedPattern& pattern, const Scene& scene,
                                       std::span<const TrackerFeature> features,
                                       TrackTimes& times) {
  LapClock clock;
  DetectionCandidate candidate;
  const auto finds = matcher_.find(pattern, features);
  candidate.matches = matcher_.matches();
  times.match += clock.lap();
  candidate.reason = candidate.matches < kFewestMatches ? Reason::kFewMatches : Reason::kNoGeometry;
  Place best;
  for (const PlaneFind& found : finds) {
    if (found.inliers < kFewestInliers || best.whole) break;
    if (candidate.reason == Reason::kVisible && 2 * found.inliers < candidate.inliers) break;
    if (candidate.reason == Reason::kNoGeometry) candidate.reason = Reason::kFailedVerification;
    find_pose(pattern, scene, found, best, candidate);
  }
  // Where a pose shows part of the pattern only, its map may show all of it.
  if (candidate.reason == Reason::kFailedVerification ||
      (candidate.reason == Reason::kVisible && !best.whole)) {
    find_map(pattern, scene, finds.front(), best.right + kMapGain, candidate);
  }
  times.homography += clock.lap();
  return candidate;
}

/// Where the patches alone settle from a start, and how well that shows the pattern.
PatternSearch::Place PatternSearch::settled(const TrackedPattern& pattern, const Scene& scene,
                                            Reach reach, const Pose& start) const {
  Place place;
  place.pose = start;
  Fit fit;
  place.settled = settle(pattern, scene, reach, place.pose, fit);
  place.right = percent_right(pattern, scene, place.pose);
  place.value = place.right;
  if (!place.settled) return place;
  const int levels = static_cast<int>(scene.pyramid.size());
  const Resolution best = finest(pattern, map_of_pose(pattern, camera_, place.pose), levels);
  place.fine = fit.level == best.frame_level;
  place.whole = place.fine && fit.share() >= kUnhidden;
  place.all = place.fine && fit.share() >= kAll;
  // The patches of the finest level tell two places apart that show as many cells.
  place.value =
      static_cast<int>(place.fine ? 0.5 * place.right + 100.0 * (fit.share() + fit.likeness)
                                  : place.right + 50.0 * fit.likeness);
  return place;
}

/// Brings a start to its place: by the features and by the patches as far as they are known from
/// them, then by the patches alone; from further away where that does not hold.
PatternSearch::Place PatternSearch::bring(const TrackedPattern& pattern, const Scene& scene,
                                          Pose start) const {
  const PlanePoints points = matcher_.inliers();
  grow(pattern, scene, points, start);
  const double before = misfit(camera_, start, points);
  Place best;
  for (const Reach reach : {Reach::kNear, Reach::kFrame, Reach::kFar}) {
    Place place = settled(pattern, scene, reach, start);
    // Patches on the edge of what hides the rest can pull a pose away from what all features say.
    const double after = misfit(camera_, place.pose, points);
    if (after > kMostMisfit * before + 1.0) place.value -= kApartLoss;
    if (after > kFarMisfit * (before + 1.0)) place.value = 0;
    if (reach == Reach::kNear || place.value > best.value) best = place;
    if (best.fine) break;
  }
  return best;
}

/// Replaces the candidate where the picture shows more of the pattern here than `best` tells.
void PatternSearch::find_pose(const TrackedPattern& pattern, const Scene& scene,
                              const PlaneFind& found, Place& best, DetectionCandidate& candidate) {
  matcher_.choose(pattern, found);
  std::array<Pose, 2> starts;
  const int count = fit_poses(pattern, camera_, found.homography, matcher_.inliers(), starts);
  if (count == 0) return;
  const bool many = found.inliers >= kManyInliers;
  const auto convinces = [&](const Place& place) {
    if (place.fine) return place.right >= (many ? kLeastPercent : kRightPercent);
    return place.right >= (many ? kRightPercent : kVaguePercent) &&
           misfit(camera_, place.pose, matcher_.inliers()) <= kVagueMisfit &&
           percent_right(pattern, scene, place.pose, kVagueCells) > 0;
  };
  const auto consider = [&](const Place& place) {
    std::array<glm::dvec2, 4> corners;
    if (place.value <= best.value || !convinces(place) ||
        !map_corners(pattern, map_of_pose(pattern, camera_, place.pose), corners) ||
        !plausible(corners)) {
      return;
    }
    best = place;
    candidate.reason = Reason::kVisible;
    candidate.pose = place.pose;
    candidate.inliers = found.inliers;
  };
  consider(settled(pattern, scene, Reach::kNear, starts[0]));
  // Of two mirror images the features may rule one out; where they do not, each shows much of the
  // pattern, and both are tried.
  const double least = misfit(camera_, starts[0], matcher_.inliers());
  const auto likely = [&](std::size_t i) {
    return misfit(camera_, starts[i], matcher_.inliers()) <= kMirrored * least + 0.5;
  };
  const bool told = count == 1 || !likely(1) || best.all;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count) && !(best.whole && told); ++i) {
    const Pose& start = starts[i];
    if (!likely(i)) continue;
    consider(bring(pattern, scene, start));
  }
}

/// A wrong focal length bends every pose, while the plane's own map still tells where it lies: its
/// corners, with the nearest pose, where much more speaks for it than a pose needs.
void PatternSearch::find_map(const TrackedPattern& pattern, const Scene& scene,
                             const PlaneFind& found, int better,
                             DetectionCandidate& candidate) const {
  if (found.inliers < kMapInliers) return;
  PlaneMap map{found.homography, bending(camera_)};
  if (map_percent(pattern, scene, map) < better) return;
  Fit fit;
  PlaneMap refined = map;
  if (settle_map(pattern, scene, refined, fit)) map = refined;
  std::array<glm::dvec2, 4> corners;
  const auto pose = nearest_pose(pattern, camera_, map);
  if (!pose || !map_corners(pattern, map, corners) || !plausible(corners)) {
    return;
  }
  candidate = {Reason::kVisible, *pose, true, map, candidate.matches, found.inliers};
}

}  // namespace modar::tracker
