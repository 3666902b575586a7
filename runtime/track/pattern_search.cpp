// Features, the patterns to match, their homographies, poses and checks; and the thread for them.
#include "pattern_search.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include <glm/matrix.hpp>

#include "photometry.hpp"
#include "runtime/platform/lap_clock.hpp"

namespace modar::tracker {
namespace {

// Features that agree with a homography at least. Lower finds small and covered patterns and takes
// time in clutter. [4, 12] tuned: pose
constexpr int kMinInliers = 6;
// Percent of the cells that must correlate where the finest patches do not fit. Lower accepts
// clutter.
constexpr int kVaguePercent = 60;
// Cells that must correlate there. Lower accepts prints that look alike by chance.
constexpr int kVagueCells = 24;
// Reprojection rms of the features there, sigmas, at most.
constexpr double kVagueRms = 3.0;
constexpr double kConfirmedRms = 3.0;  // the same of features that speak for a place by themselves
// Percent of the cells for a pose from spare features that are too few to confirm it. Lower keeps
// better poses from being tried. [45, 60] tuned: pose
constexpr int kSparePercent = 60;
// Ratio of the reprojection rms after and before patches took over, above which a place has no
// score. Higher accepts poses pulled by occluders. [1.5, 6] tuned: pose
constexpr double kWrongRms = 3.0;
// Divisor of the score of a place whose patches contradict each other. [1, 1000] tuned: pose
constexpr int kInconsistentDivisor = 8;
// Ratio of two mirror images' reprojection rms up to which both are tried. Lower misses true poses,
// higher takes time. [0.75, 3] tuned: pose
constexpr double kMirrorRms = 1.5;
// Inlier ratio from which nothing hides the pattern and no further hypothesis is tried. Lower saves
// time.
constexpr double kUnoccluded = 0.85;
// Inlier ratio from which the mirror image is not tried. Without it, frames in full view take
// longer.
constexpr double kComplete = 0.95;
// Frame pixels off a plane from which features show a bend. Lower counts noise.
constexpr double kBesideLeast = 8.0;
// Frame pixels off a plane up to which features show a bend. Higher counts clutter.
constexpr double kBesideMost = 60.0;
// Features off the plane that show a bend. Flat prints had at most 16.
constexpr int kBesideCount = 20;
// The same as a share (1 / n) of the plane's own features.
constexpr int kBesideShare = 8;
// Percent of the cells by which a plane map must exceed the best pose, since it has two more
// parameters. [10, 40] tuned: pose
constexpr int kMapGain = 20;
// Inliers that a plane map needs. [8, 32] tuned: pose
constexpr int kMapInliers = 16;

// Votes from which a pattern of many is matched in full. Higher loses tilted patterns, lower takes
// time; chance casts two.
constexpr std::uint16_t kMinVotes = 3;
// Share (1 / n) of another pattern's votes at the same place below which a pattern is skipped.
// Higher accepts prints that share a frame or logo.
constexpr int kShadowRatio = 6;
// Share of the pattern by which a place is widened: the accuracy of one vote.
constexpr double kMargin = 0.25;
// Patterns matched in full per frame. More find patterns sooner; each costs a match in full. Not
// measured.
constexpr std::ptrdiff_t kMaxLikely = 4;
// Patterns matched by votes alone if none is likely. Not measured.
constexpr std::size_t kGuesses = 2;
// Patterns matched in all, the one whose turn it is included. Not measured.
constexpr std::size_t kMatched = 3;
// Votes that agree from which such a place is matched. Higher loses small patterns.
constexpr std::uint16_t kLeastVotes = 2;
// Places matched in a frame. More find patterns sooner and take time.
constexpr std::size_t kPlaces = 3;
// Codes that the voting features of a frame are compared with, at most: with more, every n-th
// feature votes, others in the next search.
constexpr std::size_t kVoting = 400'000;
// Instructions after the votes of many from which a search tries nothing more. Higher finds more
// small or covered prints, and takes time in clutter.
constexpr std::int64_t kMostWork = 12'000'000;
constexpr std::int64_t kPatchCost = 3500;  // instructions, to compare it with the frame
// Failed places of a pattern that count against its votes, at most.
constexpr std::uint8_t kMostFailures = 8;

// Patterns not found until small places are looked for. Lower takes time.
constexpr int kSmallTurns = 7;

constexpr std::int64_t kLeastWork = 500'000;  // of a slice, or a search would never end

std::size_t max_codes(std::span<const TrackedPattern> patterns) {
  std::size_t most = 0;
  for (const TrackedPattern& pattern : patterns) most = std::max(most, pattern.features.size());
  return most;
}

std::size_t count_of_copies(std::span<const TrackedPattern> patterns) {
  std::size_t count = 0;
  for (const TrackedPattern& pattern : patterns) count += pattern.copies;
  return count;
}

/// The outline that a pattern has by one vote, with a margin.
class VotedPlace {
 public:
  VotedPlace(const TrackedPattern& pattern, const FeatureMatch& place)
      : size_(pattern.width(), pattern.height()),
        from_(place.pattern),
        to_(place.ideal),
        back_(glm::inverse(place.affine)) {}
  [[nodiscard]] bool covers(glm::dvec2 other) const {
    const glm::dvec2 at = (back_ * (other - to_) + from_) / size_;
    return std::min(at.x, at.y) > -kMargin && std::max(at.x, at.y) < 1.0 + kMargin;
  }

 private:
  glm::dvec2 size_;
  glm::dvec2 from_;
  glm::dvec2 to_;
  glm::dmat2 back_;
};

}  // namespace

[[gnu::cold]] PatternSearch::PatternSearch(const Camera& camera,
                                           std::span<const TrackedPattern> patterns,
                                           const DetectOptions& options, bool known_camera)
    : camera_(camera),
      known_camera_(known_camera),
      kernels_(kernels(options.simd)),
      patterns_(patterns),
      matcher_(camera, kernels_, static_cast<std::size_t>(options.max_features + options.max_spare),
               max_codes(patterns)) {
  selected_.reserve(patterns.size());
  has_votes_.resize(patterns.size());
  failures_.resize(patterns.size());
  if (many()) near_.reserve(matcher_.max_features());
  known_.reserve(count_of_copies(patterns));
}

bool PatternSearch::many() const {
  return patterns_.size() >= kMany;
}

bool PatternSearch::exhausted() const {
  return many() && spent_ + kPatchCost * patches_.compared() > kMostWork;
}

/// Leaves in selected_ the patterns to match in full; the first likely_ of them are probably there.
void PatternSearch::select(std::span<const TrackerFeature> features,
                           std::span<const SearchPriority> priorities) {
  selected_.clear();
  for (std::uint32_t i = 0; i < patterns_.size(); ++i) {
    if (priorities[i] != SearchPriority::kNone) selected_.push_back(i);
  }
  likely_ = selected_.size();
  if (many()) return select_places(features);
  if (selected_.size() <= kMatched) return;
  const std::span<const CodeIndex::Support> support = index_->vote(features, 0, 1);
  for (const std::uint32_t i : selected_) {
    const CodeIndex::Support& one = support[i];
    has_votes_[i] = one.votes >= kMinVotes ? 1 : 0;
    for (std::size_t k = 0; k < support.size() && has_votes_[i] != 0; ++k) {
      const bool more = support[k].votes > kShadowRatio * one.votes;
      if (more && VotedPlace(patterns_[k], support[k].place).covers(one.place.ideal))
        has_votes_[i] = 0;
    }
  }
  const auto has_votes = [&](std::uint32_t i) { return has_votes_[i] != 0; };
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    if (has_votes(a) != has_votes(b)) return has_votes(a);
    if (priorities[a] != priorities[b]) return priorities[a] == SearchPriority::kFirst;
    if (support[a].votes != support[b].votes) return support[a].votes > support[b].votes;
    return a < b;
  };
  const auto first = selected_.begin();
  std::partial_sort(first, first + kMaxLikely, selected_.end(), before);
  likely_ =
      static_cast<std::size_t>(std::find_if_not(first, first + kMaxLikely, has_votes) - first);
  const auto turn = first + static_cast<std::ptrdiff_t>(std::max(likely_, kGuesses));
  if (turn == selected_.end()) return;
  const auto since = [this](std::uint32_t i) {
    const auto count = static_cast<std::uint32_t>(patterns_.size());
    return (i + count - turn_) % count;
  };
  const auto next = std::min_element(
      turn, selected_.end(), [&](std::uint32_t a, std::uint32_t b) { return since(a) < since(b); });
  turn_ = (*next + 1) % static_cast<std::uint32_t>(patterns_.size());
  std::iter_swap(turn, next);
  selected_.erase(turn + 1, selected_.end());
}

/// Of many patterns: leaves in selected_ the few that the index places in the frame, those with
/// most votes first, and those lost a moment ago.
void PatternSearch::select_places(std::span<const TrackerFeature> features) {
  const std::size_t every = (features.size() * index_->compared() + kVoting - 1) / kVoting;
  const auto support = index_->vote(features, turn_++ % every, every);
  const auto weight = [&](std::uint32_t i) {
    const int votes = support[i].votes;
    const int lost = priorities_[i] == SearchPriority::kFirst ? 1 : 0;
    return votes < kLeastVotes ? lost : 1 + lost + std::max(votes - failures_[i], 0);
  };
  std::erase_if(selected_, [&](std::uint32_t i) { return weight(i) == 0; });
  const std::size_t count = std::min(selected_.size(), kPlaces);
  std::partial_sort(selected_.begin(), selected_.begin() + static_cast<std::ptrdiff_t>(count),
                    selected_.end(), [&](std::uint32_t a, std::uint32_t b) {
                      return weight(a) != weight(b) ? weight(a) > weight(b) : a < b;
                    });
  selected_.resize(count);
  for (std::uint8_t& failures : failures_) {
    if (failures > 0) --failures;
  }
  likely_ = 0;
}

/// The features in the place that the index gave the pattern, those that are not spare first;
/// all where it gave none. count: becomes the number of those that are not spare.
std::span<const TrackerFeature> PatternSearch::features_there(const TrackedPattern& pattern,
                                                              std::size_t& count) {
  const std::span<const TrackerFeature> found = extractor_->found();
  count = static_cast<std::size_t>(candidates_->features);
  if (!many() || index_->support()[selected_[at_]].votes < kLeastVotes) return found;
  const VotedPlace there(pattern, index_->support()[selected_[at_]].place);
  std::size_t plain = 0;
  near_.clear();
  for (const bool spare : {false, true}) {
    for (const TrackerFeature& each : spare ? found.subspan(count) : found.first(count)) {
      if (there.covers({each.x, each.y})) near_.push_back(each);
    }
    if (!spare) plain = near_.size();
  }
  count = plain;
  return near_;
}

bool PatternSearch::prepare(std::int64_t work) {
  if (ready_ || patterns_.size() <= kMatched) return true;
  if (!index_) index_ = std::make_unique<CodeIndex>(patterns_, kernels_, matcher_.max_features());
  work = std::max(work, kLeastWork);
  ready_ = index_->build(work);
  return ready_;
}

void PatternSearch::run(FeatureExtractor& extractor, std::span<const SearchPriority> priorities,
                        std::span<const KnownCopy> known, DetectionCandidates& candidates) {
  prepare(std::numeric_limits<std::int64_t>::max());
  begin(extractor, priorities, known, candidates);
  advance(std::numeric_limits<std::int64_t>::max());
}

void PatternSearch::begin(FeatureExtractor& extractor, std::span<const SearchPriority> priorities,
                          std::span<const KnownCopy> known, DetectionCandidates& candidates) {
  extractor_ = &extractor;
  priorities_ = priorities;
  candidates_ = &candidates;
  candidates.patterns.resize(patterns_.size());
  candidates.copies.reserve(known_.capacity());
  candidates.copies.clear();
  candidates.crowded = -1;
  candidates.times = {};
  known_.assign(known.begin(), known.end());
  stage_ = Stage::kFeatures;
  at_ = 0;
  found_ = false;
  next_feature_ = 0;
  features_ = Features::kHalf;
  extractor.begin();
}

/// Instructions of the next step, if it is one that is not divided; as scripts/foreign.sh counts
/// them, at most.
std::int64_t PatternSearch::cost_of_step() const {
  switch (stage_) {
    case Stage::kHypotheses:
      return 4'000'000;
    case Stage::kStart:
      return 5'000'000;
    case Stage::kRefine:
      return patterns_[selected_[at_]].surface.faces().empty() ? 5'000'000 : 10'000'000;
    case Stage::kMap:
      return 2'000'000;
    default:
      return 0;
  }
}

bool PatternSearch::advance(std::int64_t work) {
  work = std::max(work, kLeastWork);
  for (bool first = true;; first = false) {
    const std::int64_t cost = cost_of_step();
    if (!first && work < std::max<std::int64_t>(cost, 1)) return false;
    const std::int64_t before = work;
    work -= cost;
    if (!step(work)) return true;
    spent_ += before - cost - work;
  }
}

/// Extracts features; false if none exists.
bool PatternSearch::take_features(std::int64_t& work) {
  if (!extractor_->extend(work)) return true;
  const bool any = !extractor_->found().empty();
  candidates_->features = static_cast<int>(extractor_->found().size());
  for (std::size_t i = 0; i < patterns_.size(); ++i) {
    if (priorities_[i] == SearchPriority::kNone) continue;
    candidates_->patterns[i] = {};
    // Patterns that the index does not select have few matches, as far as it can tell.
    if (any) candidates_->patterns[i].reason = Reason::kFewMatches;
  }
  stage_ = Stage::kSelect;
  return any;
}

/// The next step of a search; false if none exists.
bool PatternSearch::step(std::int64_t& work) {
  LapClock clock;
  TrackTimes& times = candidates_->times;
  if (stage_ == Stage::kFeatures) {
    const bool any = take_features(work);
    times.detect += clock.lap();
    return any;
  }
  if (stage_ == Stage::kSelect) {
    select(extractor_->found(), priorities_);
    spent_ = -kPatchCost * patches_.compared();
    times.match += clock.lap();
    stage_ = Stage::kMatch;
  }
  if (at_ == selected_.size() || (at_ >= likely_ && found_)) return false;
  if (stage_ == Stage::kMatch && next_feature_ == 0 && exhausted()) return false;
  const TrackedPattern& pattern = patterns_[selected_[at_]];
  const FrameView frame{camera_, extractor_->pyramid(), kernels_, patches_};
  const bool matching = stage_ < Stage::kStart;
  switch (stage_) {
    case Stage::kMatch:
      match_features(pattern, work);
      break;
    case Stage::kVote:
      if (matcher_.vote(work)) stage_ = Stage::kHypotheses;
      break;
    case Stage::kHypotheses:
      take_hypotheses();
      break;
    case Stage::kStart:
      start_hypothesis(pattern, frame);
      break;
    case Stage::kRefine:
      consider(pattern, frame, refine_start(pattern, frame, starts_[start_]));
      ++start_;
      after_start();
      break;
    default:
      conclude(pattern, frame);
      break;
  }
  (matching ? times.match : times.homography) += clock.lap();
  return true;
}

void PatternSearch::match_features(const TrackedPattern& pattern, std::int64_t& work) {
  if (features_ == Features::kSpare && !extractor_->extend_spare(work)) return;
  std::size_t count = 0;
  const std::span<const TrackerFeature> features = features_there(pattern, count);
  const std::size_t ends[] = {(count + 1) / 2, count, features.size()};
  const std::size_t end = ends[static_cast<std::size_t>(features_)];
  if (!matcher_.match(pattern, features, count, end, next_feature_, work)) return;
  begin_vote();
}

/// Votes with the matches that no known copy explains.
void PatternSearch::begin_vote() {
  for (const KnownCopy& copy : known_) {
    if (copy.pattern == selected_[at_]) matcher_.forget(copy.map);
  }
  matcher_.begin_vote(features_ == Features::kSpare ? kSpareVotes : kVotes);
  stage_ = Stage::kVote;
}

void PatternSearch::take_hypotheses() {
  DetectionCandidate& candidate = candidates_->patterns[selected_[at_]];
  hypotheses_ = matcher_.hypotheses();
  const bool failed =
      features_ == Features::kSpare && candidate.reason == Reason::kFailedVerification;
  candidate = {};
  candidate.matches = matcher_.matches();
  const bool few = candidate.matches < static_cast<int>(kMinMatches);
  candidate.reason = failed ? Reason::kFailedVerification
                     : few  ? Reason::kFewMatches
                            : Reason::kNoGeometry;
  best_ = {};
  hypothesis_ = 0;
  next_hypothesis();
}

void PatternSearch::start_hypothesis(const TrackedPattern& pattern, const FrameView& frame) {
  DetectionCandidate& candidate = candidates_->patterns[selected_[at_]];
  // Among all votes of the spare features some agree by chance in any picture.
  const bool chance =
      features_ == Features::kSpare && hypotheses_[hypothesis_].inliers < kConfirmingFeatures;
  if (candidate.reason == Reason::kNoGeometry && !chance) {
    candidate.reason = Reason::kFailedVerification;
  }
  fit_starts(pattern, frame);
  // The features may rule out one of two mirror images; otherwise each shows much of the
  // pattern, and both are tried.
  decided_ = start_count_ < 2 || !likely(1) || best_.complete;
  after_start();
}

/// To the next start of the hypothesis that is worth refining, the next hypothesis, or the end.
void PatternSearch::after_start() {
  while (start_ < start_count_ && !likely(start_)) ++start_;
  stage_ = Stage::kRefine;
  if (features_ == Features::kHalf && !(best_.unoccluded && decided_)) {
    best_ = {};
    stage_ = Stage::kMap;
  } else if (start_ >= start_count_ || (best_.unoccluded && decided_)) {
    ++hypothesis_;
    next_hypothesis();
  }
}

/// Ends the search for a pattern, or starts it once more with more features.
void PatternSearch::conclude(const TrackedPattern& pattern, const FrameView& frame) {
  stage_ = Stage::kMatch;
  // Half of the features place a pattern that nothing hides as well as all of them, in 36 instead
  // of 49 million instructions (scripts/foreign.sh budget); else what they found counts for
  // nothing.
  if (features_ == Features::kHalf && !best_.unoccluded && !exhausted()) {
    features_ = Features::kAll;
    return;
  }
  DetectionCandidate& candidate = candidates_->patterns[selected_[at_]];
  // Where a pose shows a part of the pattern only, a plane map may show all of it.
  if (candidate.reason == Reason::kFailedVerification ||
      (candidate.reason == Reason::kVisible && !best_.unoccluded)) {
    find_map(pattern, frame, hypotheses_.front(), best_.percent + kMapGain, candidate);
  }
  if (candidate.reason != Reason::kVisible) note_place(pattern);
  // Small patterns have too few of the frame's features: of those at 2 to 5 % of the frame, 41 %
  // were found without the spare ones, and 67 % with them; of those covered to 70 %, 83 and 90 %
  // were right.
  if (candidate.reason != Reason::kVisible && features_ == Features::kAll && !exhausted()) {
    features_ = Features::kSpare;
    return;
  }
  if (candidate.reason == Reason::kVisible && bent(pattern)) candidate.reason = Reason::kCurved;
  found_ = found_ || candidate.reason == Reason::kVisible;
  candidate.place = place_;
  place_ = {};
  if (many() && !found_ && failures_[selected_[at_]] < kMostFailures)
    failures_[selected_[at_]] += 2;
  if (candidate.reason == Reason::kVisible && search_next_copy(pattern, frame)) return;
  ++at_;
  next_feature_ = 0;
  features_ = Features::kHalf;
}

/// A copy was found: whether the search continues for another one, among the other matches.
bool PatternSearch::search_next_copy(const TrackedPattern& pattern, const FrameView& frame) {
  const std::uint32_t which = selected_[at_];
  const auto known = std::count_if(known_.begin(), known_.end(),
                                   [&](const KnownCopy& copy) { return copy.pattern == which; });
  if (known + 1 >= static_cast<std::ptrdiff_t>(pattern.copies)) {
    if (shows_another(pattern, frame))
      candidates_->crowded = static_cast<std::int32_t>(pattern.index);
    return false;
  }
  const DetectionCandidate& found = candidates_->patterns[which];
  KnownCopy copy{which,
                 found.homography_only ? found.map : map_of_pose(pattern, camera_, found.pose)};
  copy.map.lens = nullptr;
  known_.push_back(copy);
  candidates_->copies.emplace_back(which, found);
  candidates_->patterns[which] = {};
  begin_vote();
  return true;
}

/// Whether the features left over show one more copy than may be tracked.
bool PatternSearch::shows_another(const TrackedPattern& pattern, const FrameView& frame) const {
  std::array<glm::dvec2, 4> found;
  if (!pattern.surface.flat() ||
      !map_corners(pattern,
                   map_of_pose(pattern, camera_, candidates_->patterns[selected_[at_]].pose),
                   found)) {
    return false;
  }
  for (const HomographyHypothesis& each : hypotheses_) {
    if (each.inliers < kMapInliers) return false;
    const PlaneMap map{each.homography, distorting_lens(camera_)};
    std::array<glm::dvec2, 4> corners;
    if (map_corners(pattern, map, corners) && plausible(corners) && !same_place(found, corners) &&
        map_photometric_percent(pattern, frame, map) > 0) {
      return true;
    }
  }
  return false;
}

/// Keeps the place that most votes agree on, of a pattern that was not found.
void PatternSearch::note_place(const TrackedPattern& pattern) {
  if (features_ == Features::kSpare) {
    small_.add(pattern, matcher_.all_matches());
    if (++missed_ % kSmallTurns == 0) small_.find(pattern, place_);
  }
  int votes = 0;
  const FeatureMatch* const match = matcher_.strongest(votes);
  if (match == nullptr || votes <= place_.votes) return;
  place_ = place_of(pattern, *match);
  place_.votes = votes;
}

/// Continues the next hypothesis if it may exceed the best so far.
void PatternSearch::next_hypothesis() {
  const DetectionCandidate& candidate = candidates_->patterns[selected_[at_]];
  stage_ = Stage::kMap;
  if (hypothesis_ == hypotheses_.size() || best_.unoccluded || exhausted()) return;
  const int inliers = hypotheses_[hypothesis_].inliers;
  if (inliers < kMinInliers) return;
  if (candidate.reason == Reason::kVisible && 2 * inliers < candidate.inliers) return;
  stage_ = Stage::kStart;
}

/// Where the patches alone lead from a start, and how much of the pattern shows there.
PatternSearch::PoseCandidate PatternSearch::evaluate_start(const TrackedPattern& pattern,
                                                           const FrameView& frame,
                                                           SearchRadius radius,
                                                           const Pose& start) const {
  PoseCandidate out;
  out.pose = start;
  PatchFit fit;
  out.refined = refine(pattern, frame, radius, out.pose, fit);
  out.percent = photometric_percent(pattern, frame, out.pose);
  out.score = out.percent;
  if (!out.refined) return out;
  const int levels = static_cast<int>(frame.pyramid.size());
  const Resolution best = tracker::finest(pattern, map_of_pose(pattern, camera_, out.pose), levels);
  out.finest = fit.level == best.frame_level;
  out.unoccluded = out.finest && fit.inlier_ratio() >= kUnoccluded;
  out.complete = out.finest && fit.inlier_ratio() >= kComplete;
  out.few = fit.inliers * 5 < fit.visible;
  out.close = fit.close >= kClosePatches;
  out.inconsistent = known_camera_ && fit.inconsistent();
  // Of two places that show as many cells, the finest level's patches tell the better one.
  out.score = static_cast<int>(out.finest ? 0.5 * out.percent +
                                                100.0 * (fit.inlier_ratio() + fit.correlation)
                                          : out.percent + 50.0 * fit.correlation);
  // Only where there is nothing else.
  if (out.inconsistent) out.score = out.score / kInconsistentDivisor;
  return out;
}

/// Refines a start by features and those patches that they predict, then by patches alone, from
/// further away if that does not fit.
PatternSearch::PoseCandidate PatternSearch::refine_start(const TrackedPattern& pattern,
                                                         const FrameView& frame, Pose start) const {
  const PlanePoints points = matcher_.inliers();
  refine_from_inliers(pattern, frame, points, start);
  const double before = reprojection_rms(camera_, start, points);
  PoseCandidate best;
  for (const SearchRadius radius :
       {SearchRadius::kNear, SearchRadius::kFrame, SearchRadius::kFar}) {
    PoseCandidate now = evaluate_start(pattern, frame, radius, start);
    const double after = reprojection_rms(camera_, now.pose, points);
    if (after > kWrongRms * (before + 1.0)) now.score = 0;
    if (radius == SearchRadius::kNear || now.score > best.score) best = now;
    if ((best.finest && !best.inconsistent) || exhausted()) break;
  }
  const bool boxed = best.refined && !pattern.surface.faces().empty();
  return boxed ? ask_other_faces(pattern, frame, best) : best;
}

/// A pose that one face of a box tells has a mirror image, which shows that face nearly alike and
/// others not: the one in which more cells agree.
PatternSearch::PoseCandidate PatternSearch::ask_other_faces(const TrackedPattern& pattern,
                                                            const FrameView& frame,
                                                            const PoseCandidate& one) const {
  // Cells by which one mirror image must exceed the other. Lower lets noise decide between two
  // equal images. Not swept.
  constexpr int kMoreCells = 3;
  const auto cells_at = [&](const Pose& pose) {
    return check_photometry(pattern, map_of_pose(pattern, camera_, pose), frame.pyramid);
  };
  const PhotometricCheck own = cells_at(one.pose);
  const auto best = std::max_element(own.of_face.begin(), own.of_face.end()) - own.of_face.begin();
  const auto& place = pattern.surface.faces()[static_cast<std::size_t>(best)].place;
  const glm::dvec2 middle{place[0] + 0.5 * place[2], place[1] + 0.5 * place[3]};
  const PoseCandidate other =
      evaluate_start(pattern, frame, SearchRadius::kFar, mirrored_about(pattern, middle, one.pose));
  const bool better = other.refined && cells_at(other.pose).matching > own.matching + kMoreCells;
  return better ? other : one;
}

bool PatternSearch::has_enough_inliers() const {
  return hypotheses_[hypothesis_].inliers >= kConfirmingFeatures && least_rms_ <= kConfirmedRms;
}

bool PatternSearch::passes_verification(const TrackedPattern& pattern, const FrameView& frame,
                                        const PoseCandidate& one) const {
  if (features_ == Features::kSpare && one.percent < kSparePercent && !has_enough_inliers())
    return false;
  if (one.finest && has_enough_inliers() && !one.few) return one.percent >= kConfirmedPercent;
  if (one.finest) return one.percent >= (one.close ? kClosePatchesPercent : kMinPercent);
  return one.percent >= (has_enough_inliers() ? kMinPercent : kVaguePercent) &&
         reprojection_rms(camera_, one.pose, matcher_.inliers()) <= kVagueRms &&
         photometric_percent(pattern, frame, one.pose, kVagueCells) > 0;
}

/// Whether many features continue the place that was found, but off its plane.
bool PatternSearch::bent(const TrackedPattern& pattern) const {
  if (!pattern.surface.flat() || best_.unoccluded || best_.score == 0) return false;
  const HomographyHypothesis& found = hypotheses_[best_hypothesis_];
  const int beside = matcher_.beside(found, kBesideLeast, kBesideMost);
  return beside >= kBesideCount && beside * kBesideShare >= found.inliers;
}

/// Replaces the best pose, and the candidate, if this one shows more of the pattern.
void PatternSearch::consider(const TrackedPattern& pattern, const FrameView& frame,
                             const PoseCandidate& one) {
  std::array<glm::dvec2, 4> corners;
  if (one.score <= best_.score || !passes_verification(pattern, frame, one) ||
      !locate_corners(pattern, map_of_pose(pattern, camera_, one.pose), corners)) {
    return;
  }
  best_ = one;
  best_hypothesis_ = hypothesis_;
  DetectionCandidate& candidate = candidates_->patterns[selected_[at_]];
  candidate.reason = Reason::kVisible;
  candidate.pose = one.pose;
  candidate.inconsistent = one.inconsistent;
  candidate.inliers = hypotheses_[hypothesis_].inliers;
}

/// Whether the features do not rule a start out against the first.
bool PatternSearch::likely(std::size_t start) const {
  return reprojection_rms(camera_, starts_[start], matcher_.inliers()) <=
         kMirrorRms * least_rms_ + 0.5;
}

/// The poses of a hypothesis, and where the first leads to by patches alone.
void PatternSearch::fit_starts(const TrackedPattern& pattern, const FrameView& frame) {
  const HomographyHypothesis& hypothesis = hypotheses_[hypothesis_];
  const int spread = pattern.surface.flat() ? 0 : matcher_.spread(pattern, hypothesis_, starts_);
  matcher_.select(pattern, hypothesis);
  start_ = 0;
  start_count_ = static_cast<std::size_t>(
      pattern.surface.flat()
          ? fit_poses(pattern, camera_, hypothesis.homography, matcher_.inliers(), starts_)
          : spread);
  if (start_count_ == 0) return;
  least_rms_ = reprojection_rms(camera_, starts_[0], matcher_.inliers());
  consider(pattern, frame, evaluate_start(pattern, frame, SearchRadius::kNear, starts_[0]));
}

/// A wrong focal length bends every pose, but the plane's map still tells the corners: takes them,
/// with the nearest pose, where the map shows at least `min_percent`.
void PatternSearch::find_map(const TrackedPattern& pattern, const FrameView& frame,
                             const HomographyHypothesis& hypothesis, int min_percent,
                             DetectionCandidate& candidate) const {
  if (hypothesis.inliers < kMapInliers || !pattern.surface.flat()) return;
  PlaneMap map{hypothesis.homography, distorting_lens(camera_)};
  if (map_photometric_percent(pattern, frame, map) < min_percent) return;
  PatchFit fit;
  PlaneMap refined = map;
  if (refine_map(pattern, frame, refined, fit)) map = refined;
  std::array<glm::dvec2, 4> corners;
  const auto pose = nearest_pose(pattern, camera_, map);
  if (!pose || !map_corners(pattern, map, corners) || !plausible(corners)) return;
  candidate = {Reason::kVisible,   *pose, true, map, false, candidate.matches,
               hypothesis.inliers, {}};
}

// ---- Of a copy of the frame, in slices or on a thread of its own ----

[[gnu::cold]] FrameSearch::FrameSearch(const Camera& camera,
                                       std::span<const TrackedPattern> patterns,
                                       const DetectOptions& options, bool known_camera)
    : extractor(FeatureExtractor::create(camera.width, camera.height, options)),
      search(camera, patterns, options, known_camera),
      pixels(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height)),
      priorities(patterns.size(), SearchPriority::kNone) {
  frame = {pixels.data(), camera.width, camera.height, camera.width};
  found.patterns.resize(patterns.size());
  known.reserve(count_of_copies(patterns));
}

void FrameSearch::set(const GrayImage& caller_frame,
                      std::span<const SearchPriority> caller_priorities,
                      std::span<const KnownCopy> caller_known) {
  known.assign(caller_known.begin(), caller_known.end());
  for (int y = 0; y < frame.height; ++y) {
    std::memcpy(pixels.data() + y * frame.stride, caller_frame.pixels + y * caller_frame.stride,
                static_cast<std::size_t>(frame.width));
  }
  std::copy(caller_priorities.begin(), caller_priorities.end(), priorities.begin());
}

void SlicedDetector::start(const GrayImage& frame, std::span<const SearchPriority> priorities,
                           std::span<const KnownCopy> known) {
  job_.set(frame, priorities, known);
  job_.extractor->set_frame(job_.frame);
  job_.search.begin(*job_.extractor, job_.priorities, job_.known, job_.found);
  busy_ = true;
}

bool SlicedDetector::advance(std::int64_t work, DetectionCandidates& candidates,
                             std::vector<SearchPriority>& priorities) {
  if (!prepared_) prepared_ = job_.search.prepare(work);
  if (!busy_) return false;
  if (!finished_) {
    finished_ = job_.search.advance(work);
    return false;  // moving a find to the present frame costs too much to do both
  }
  std::swap(candidates, job_.found);
  priorities.swap(job_.priorities);
  busy_ = finished_ = false;
  return true;
}

[[gnu::cold]] AsyncDetector::AsyncDetector(const Camera& camera,
                                           std::span<const TrackedPattern> patterns,
                                           const DetectOptions& options, bool known_camera)
    : job_(camera, patterns, options, known_camera) {
  thread_ = std::thread([this] { work(); });
}

AsyncDetector::~AsyncDetector() {
  closing_.store(true, std::memory_order_release);
  wake_.release();
  thread_.join();
}

void AsyncDetector::start(const GrayImage& frame, std::span<const SearchPriority> priorities,
                          std::span<const KnownCopy> known) {
  job_.set(frame, priorities, known);
  stage_.store(Stage::kSearching, std::memory_order_release);
  wake_.release();
}

bool AsyncDetector::take(DetectionCandidates& candidates, std::vector<SearchPriority>& priorities) {
  if (stage_.load(std::memory_order_acquire) != Stage::kFound) return false;
  std::swap(candidates, job_.found);
  priorities.swap(job_.priorities);
  stage_.store(Stage::kIdle, std::memory_order_release);
  return true;
}

void AsyncDetector::work() {
  for (;;) {
    wake_.acquire();
    if (closing_.load(std::memory_order_acquire)) return;
    job_.extractor->set_frame(job_.frame);
    job_.search.run(*job_.extractor, job_.priorities, job_.known, job_.found);
    stage_.store(Stage::kFound, std::memory_order_release);
  }
}

}  // namespace modar::tracker
