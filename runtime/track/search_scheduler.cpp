// One search at a time.
#include "search_scheduler.hpp"

#include <algorithm>
#include <cstdint>

namespace modar::tracker {
namespace {

// Budget, million instructions per frame, from which the searching frame refines and verifies, too.
// Below it, the next frame does.
constexpr int kVerifyingBudget = 20;

}  // namespace

[[gnu::cold]] SearchScheduler::SearchScheduler(const Camera& camera,
                                               std::span<const TrackedPattern> patterns,
                                               const PoseLoopOptions& options)
    : options_(options),
      camera_(camera),
      patterns_(patterns.begin(),
                patterns.begin() + static_cast<std::ptrdiff_t>(count_of_prints(patterns))) {
  priorities_.resize(patterns_.size());
  candidates_.patterns.resize(patterns_.size());
  const bool known = !options.estimate_camera;
  if (options.async_search) {
    async_ = std::make_unique<AsyncDetector>(camera_, patterns_, options.detect, known);
  } else if (options.budget > 0) {
    sliced_ = std::make_unique<SlicedDetector>(camera_, patterns_, options.detect, known);
  } else {
    search_ = std::make_unique<PatternSearch>(camera_, patterns_, options.detect, known);
  }
}

bool SearchScheduler::idle() const {
  if (async_ != nullptr) return async_->idle();
  return sliced_ == nullptr || sliced_->idle();
}

bool SearchScheduler::verifies_finds() const {
  return sliced_ == nullptr || options_.budget >= kVerifyingBudget;
}

bool SearchScheduler::take() {
  if (async_ == nullptr || !async_->take(candidates_, priorities_)) return false;
  const bool wanted = !discard_found_;
  discard_found_ = false;
  return wanted;
}

bool SearchScheduler::advance(std::ptrdiff_t tracked) {
  // Pyramid, a copy of the frame, and by what a step may exceed its cost.
  constexpr std::int64_t kFrameCost = 2'000'000;
  constexpr std::int64_t kTrackCost = 3'000'000;  // of a pattern; as much to move a find here
  if (sliced_ == nullptr) return false;
  const std::int64_t work =
      std::int64_t{1'000'000} * options_.budget - kFrameCost - kTrackCost * (tracked + 1);
  return sliced_->advance(work, candidates_, priorities_);
}

bool SearchScheduler::due(std::span<const TrackedPattern> patterns, std::span<const Track> tracks,
                          bool following) {
  std::fill(priorities_.begin(), priorities_.end(), SearchPriority::kNone);
  bool missing = false;
  bool recently = false;
  bool any_tracked = false;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& track = tracks[i];
    const bool lost = track.frames_since_lost < kRecentFrames;
    SearchPriority& priority = priorities_[patterns[i].first];
    if (!track.tracked)
      priority = std::max(priority, lost ? SearchPriority::kFirst : SearchPriority::kNormal);
    missing = missing || !track.tracked;
    recently = recently || (!track.tracked && lost);
    any_tracked = any_tracked || track.tracked;
  }
  --frames_to_search_;
  // While one is tracked, only patterns lost a moment ago are worth a search in every frame; while
  // the surroundings say where one is, it is looked for there.
  const bool waits = following || (any_tracked && !recently);
  if (!missing || (waits && frames_to_search_ > 0) || !idle()) return false;
  frames_to_search_ = options_.search_every;
  return true;
}

bool SearchScheduler::start(const GrayImage& frame, FeatureExtractor& extractor,
                            std::span<const KnownCopy> known) {
  if (async_ != nullptr) {
    async_->start(frame, priorities_, known);
  } else if (sliced_ != nullptr) {
    sliced_->start(frame, priorities_, known);
  } else {
    search_->run(extractor, priorities_, known, candidates_);
    return true;
  }
  return false;
}

void SearchScheduler::reset() {
  frames_to_search_ = 0;
  if (sliced_ != nullptr) sliced_->cancel();
  discard_found_ = async_ != nullptr && !async_->idle();
}

}  // namespace modar::tracker
