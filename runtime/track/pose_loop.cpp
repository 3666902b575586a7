// The states of the loop: search for patterns, track those found, give the reason if there is none.
#include "modar/pose_loop.hpp"

#include <algorithm>
#include <vector>

#include "frame_tracker.hpp"
#include "pattern_search.hpp"
#include "print_judge.hpp"
#include "runtime/platform/lap_clock.hpp"

namespace modar {
namespace {

using tracker::DetectionCandidate;
using tracker::PatchFit;
using tracker::PrintJudge;
using tracker::SearchPriority;
using tracker::Track;
using tracker::TrackedPattern;

// Millions of instructions a frame from which a pattern can be brought to it and judged.
constexpr int kJudgingBudget = 20;

}  // namespace

struct PoseLoop::State {
  State(const Camera& seen_by, const PoseLoopOptions& how)
      : camera(seen_by), options(how), frame_tracker(seen_by, how.detect) {}

  Camera camera;
  PoseLoopOptions options;
  std::vector<TrackedPattern> patterns;
  std::vector<Track> tracks;  ///< one a pattern
  std::unique_ptr<PrintJudge> print_judge;
  tracker::FrameTracker frame_tracker;
  std::unique_ptr<tracker::PatternSearch> search;   ///< on the caller's thread, or
  std::unique_ptr<tracker::AsyncDetector> async;    ///< on its own
  std::unique_ptr<tracker::SlicedDetector> sliced;  ///< there, within the budget of a frame
  std::vector<SearchPriority> priorities;
  tracker::DetectionCandidates candidates;
  int frames_to_search = 0;
  bool discard_found = false;  ///< what the running search finds is of before a reset

  void step(const GrayImage& frame, TrackResult& result);
  void track_all(TrackResult& result);
  void advance_search(TrackResult& result);
  bool search_due(bool any_tracked);
  void accept(TrackResult& result);
  bool start_track(const TrackedPattern& pattern, Track& track, const DetectionCandidate& candidate,
                   Detection& detection) const;
  bool resolve_overlap(std::size_t i, const Detection& detection, TrackResult& result);
  bool show(std::size_t i, const PrintJudge::Verdict& verdict, Detection& detection,
            TrackResult& result);
  bool rename(std::size_t from, std::size_t to, Detection& detection);
};

PoseLoop::PoseLoop(std::unique_ptr<State> state) : state_(std::move(state)) {}
PoseLoop::~PoseLoop() = default;

Result<std::unique_ptr<PoseLoop>> PoseLoop::create(const BundleView& bundle, const Camera& camera,
                                                   const PoseLoopOptions& options) {
  if (camera.width < 1 || camera.height < 1 || camera.width > 16384 || camera.height > 16384) {
    return fail(ExitCode::kInvalidInput, "tracker.frame-size", "", "the camera has no frame size",
                "give a camera of 1 to 16384 pixels a side");
  }
  auto state = std::make_unique<State>(camera, options);
  const std::uint32_t count = bundle.patterns().size();
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto bytes = bundle.section(SectionType::kTrackerRecord, i);
    if (bytes.empty()) continue;
    MODAR_ASSIGN(const TrackedPattern pattern,
                 tracker::view_tracked_pattern(bytes, i, bundle.section(kPatternShape, i)));
    state->patterns.push_back(pattern);
  }
  if (state->patterns.empty()) {
    return fail(ExitCode::kInvalidInput, "tracker.no-patterns", "",
                "the bundle holds no pattern with a record for this loop",
                "bake it with a pattern");
  }
  state->tracks.resize(state->patterns.size());
  state->print_judge = std::make_unique<PrintJudge>(state->patterns);
  state->priorities.resize(state->patterns.size());
  state->candidates.patterns.resize(state->patterns.size());
  if (options.async_search) {
    state->async =
        std::make_unique<tracker::AsyncDetector>(camera, state->patterns, options.detect);
  } else if (options.budget > 0) {
    state->sliced =
        std::make_unique<tracker::SlicedDetector>(camera, state->patterns, options.detect);
  } else {
    state->search =
        std::make_unique<tracker::PatternSearch>(camera, state->patterns, options.detect);
  }
  return std::unique_ptr<PoseLoop>(new PoseLoop(std::move(state)));
}

void PoseLoop::reset() {
  for (Track& track : state_->tracks) track = {};
  state_->frames_to_search = 0;
  if (state_->sliced != nullptr) state_->sliced->cancel();
  state_->discard_found = state_->async != nullptr && !state_->async->idle();
}

Result<TrackResult> PoseLoop::step(const GrayImage& frame) {
  TrackResult result;
  MODAR_TRY(step(frame, result));
  return result;
}

Result<void> PoseLoop::step(const GrayImage& frame, TrackResult& result) {
  const Camera& camera = state_->camera;
  if (frame.pixels == nullptr || frame.width != camera.width || frame.height != camera.height ||
      frame.stride < frame.width) {
    return fail(ExitCode::kInvalidInput, "tracker.frame-size", "",
                "a frame of " + std::to_string(frame.width) + "x" + std::to_string(frame.height) +
                    " for a camera of " + std::to_string(camera.width) + "x" +
                    std::to_string(camera.height),
                "create the loop with the camera of these frames");
  }
  state_->step(frame, result);
  return {};
}

/// Whether this frame is searched for the patterns that are not tracked; sets their priorities.
bool PoseLoop::State::search_due(bool any_tracked) {
  bool missing = false;
  bool recently = false;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    const bool lost = track.frames_since_lost < tracker::kRecentFrames;
    priorities[i] = track.tracked ? SearchPriority::kNone
                    : lost        ? SearchPriority::kFirst
                                  : SearchPriority::kNormal;
    missing = missing || !track.tracked;
    recently = recently || (!track.tracked && lost);
  }
  --frames_to_search;
  // While one is tracked, only patterns lost a moment ago are worth a search in every frame.
  if (!missing || (any_tracked && !recently && frames_to_search > 0)) return false;
  if (async != nullptr && !async->idle()) return false;
  if (sliced != nullptr && !sliced->idle()) return false;
  frames_to_search = options.search_every;
  return true;
}

void PoseLoop::State::step(const GrayImage& frame, TrackResult& result) {
  result.visible.clear();
  result.visible.reserve(tracks.size());
  result.reason = Reason::kNoFeatures;
  result.features = 0;
  result.times = {};
  LapClock clock;
  frame_tracker.set_frame(frame);
  track_all(result);
  if (async != nullptr && async->take(candidates, priorities)) {
    if (!discard_found) accept(result);
    discard_found = false;
  }
  if (sliced != nullptr) advance_search(result);
  result.times.pose = clock.lap();
  const bool any_tracked =
      std::any_of(tracks.begin(), tracks.end(), [](const Track& track) { return track.tracked; });
  if (search_due(any_tracked)) {
    if (async != nullptr) {
      async->start(frame, priorities);
    } else if (sliced != nullptr) {
      sliced->start(frame, priorities);
    } else {
      search->run(frame_tracker.extractor(), priorities, candidates);
      accept(result);
    }
  }
  for (const Track& track : tracks) {
    const Reason reason = track.tracked ? track.shown_reason : track.last_reason;
    if (progress(reason) > progress(result.reason)) result.reason = reason;
  }
  std::sort(result.visible.begin(), result.visible.end(),
            [](const Detection& a, const Detection& b) { return a.pattern < b.pattern; });
}

/// Goes on with the search by what tracking left of the frame's budget.
void PoseLoop::State::advance_search(TrackResult& result) {
  // Pyramid, a copy of the frame, and by what a step may exceed its cost.
  constexpr std::int64_t kFrameCost = 2'000'000;
  constexpr std::int64_t kTrackCost = 3'000'000;  // of a pattern; as much to bring a find here
  const auto tracked =
      std::count_if(tracks.begin(), tracks.end(), [](const Track& track) { return track.tracked; });
  const std::int64_t work =
      std::int64_t{1'000'000} * options.budget - kFrameCost - kTrackCost * (tracked + 1);
  if (sliced->advance(work, candidates, priorities)) accept(result);
}

void PoseLoop::State::track_all(TrackResult& result) {
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    Detection detection;
    if (!track.tracked) {
      track.frames_since_lost = std::min(track.frames_since_lost + 1, tracker::kRecentFrames);
      continue;
    }
    track.tracked = options.track && frame_tracker.update(patterns[i], track, detection);
    if (track.tracked) {
      const auto frame = frame_tracker.frame();
      show(i,
           track.judged ? print_judge->follow(i, frame, track)
                        : print_judge->meet(i, frame, track, track.again),
           detection, result);
      track.judged = true;
    } else {
      track.frames_since_lost = options.track ? 0 : tracker::kRecentFrames;
    }
  }
}

/// Adds what is tracked to the result, by the name that the judge gives it, unless it is not to be
/// shown. Returns whether it was added.
bool PoseLoop::State::show(std::size_t i, const PrintJudge::Verdict& verdict, Detection& detection,
                           TrackResult& result) {
  tracks[i].shown_reason = verdict.reason;
  detection.agreeing = verdict.agreeing;
  detection.likeness = verdict.likeness;
  if (verdict.rival >= 0 && rename(i, static_cast<std::size_t>(verdict.rival), detection)) {
    result.visible.push_back(detection);
    return true;
  }
  if (verdict.reason != Reason::kVisible) return false;
  result.visible.push_back(detection);
  return true;
}

/// The frame shows another pattern in the place of a tracked one: goes on with that one.
bool PoseLoop::State::rename(std::size_t from, std::size_t to, Detection& detection) {
  if (tracks[to].tracked || tracks[from].homography_only) return false;
  const TrackedPattern& pattern = patterns[to];
  Track next;
  next.pose = tracks[from].pose;
  PatchFit fit;
  Detection renamed = detection;
  if (!tracker::refine(pattern, frame_tracker.frame(), tracker::SearchRadius::kClose, next.pose,
                       fit) ||
      !frame_tracker.locate(pattern, next, renamed)) {
    return false;
  }
  const PrintJudge::Verdict verdict = print_judge->meet(to, frame_tracker.frame(), next, false);
  if (verdict.reason != Reason::kVisible || verdict.rival >= 0) return false;
  renamed.agreeing = verdict.agreeing;
  renamed.likeness = verdict.likeness;
  renamed.matches = fit.visible;
  renamed.inliers = fit.inliers;
  next.tracked = next.judged = true;
  tracks[to] = next;
  tracks[from] = {};
  tracks[from].last_reason = Reason::kOtherPrint;
  detection = renamed;
  return true;
}

/// Starts a track; false if the candidate is not visible in the present frame.
bool PoseLoop::State::start_track(const TrackedPattern& pattern, Track& track,
                                  const DetectionCandidate& candidate, Detection& detection) const {
  Track next;
  next.pose = candidate.pose;
  next.homography_only = candidate.homography_only;
  next.map = candidate.map;
  detection.matches = candidate.matches;
  detection.inliers = candidate.inliers;
  if (async != nullptr || sliced != nullptr) {
    // It was found in an earlier frame.
    PatchFit fit;
    const bool here = next.homography_only
                          ? tracker::refine_map(pattern, frame_tracker.frame(), next.map, fit)
                          : tracker::refine(pattern, frame_tracker.frame(),
                                            tracker::SearchRadius::kFar, next.pose, fit) &&
                                tracker::photometric_percent(pattern, frame_tracker.frame(),
                                                             next.pose) >= tracker::kMinPercent;
    if (!here) return false;
  }
  if (!frame_tracker.locate(pattern, next, detection)) return false;
  next.tracked = true;
  track = next;
  return true;
}

/// Prints of one series share so much that one is taken for the other: of those that claim one
/// place, the one stays that shows more. Returns whether the new pattern i stays; the others are
/// then dropped.
bool PoseLoop::State::resolve_overlap(std::size_t i, const Detection& detection,
                                      TrackResult& result) {
  const auto percent_of = [this](std::size_t which) {
    const Track& track = tracks[which];
    if (track.shown_reason != Reason::kVisible) return 0;
    return track.homography_only
               ? tracker::map_photometric_percent(patterns[which], frame_tracker.frame(), track.map)
               : tracker::photometric_percent(patterns[which], frame_tracker.frame(), track.pose);
  };
  // None is dropped before the new one is known to stay.
  for (const bool drop : {false, true}) {
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      Detection rival;
      const bool other =
          k != i && tracks[k].tracked && frame_tracker.locate(patterns[k], tracks[k], rival);
      if (!other || !tracker::same_place(frame_tracker.place(patterns[k], tracks[k], rival),
                                         frame_tracker.place(patterns[i], tracks[i], detection))) {
        continue;
      }
      if (!drop) {
        if (percent_of(i) <= percent_of(k)) return false;
        continue;
      }
      tracks[k] = {};
      tracks[k].last_reason = Reason::kFailedVerification;
      std::erase_if(result.visible, [&](const Detection& s) { return s.pattern == rival.pattern; });
    }
  }
  return true;
}

/// Brings what a search found into the tracks and the frame's result.
void PoseLoop::State::accept(TrackResult& result) {
  result.features = candidates.features;
  result.times.detect = candidates.times.detect;
  result.times.match = candidates.times.match;
  result.times.homography = candidates.times.homography;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    if (priorities[i] == SearchPriority::kNone || track.tracked) continue;
    const DetectionCandidate& candidate = candidates.patterns[i];
    const Track before = track;
    Detection detection;
    const bool here = candidate.reason == Reason::kVisible &&
                      start_track(patterns[i], track, candidate, detection);
    Reason reason =
        candidate.reason == Reason::kVisible ? Reason::kFailedVerification : candidate.reason;
    if (here) {
      track.again = before.frames_since_lost < tracker::kRecentFrames;
      PrintJudge::Verdict verdict;
      // Within a small budget, bringing it here takes what a frame has: the next one judges.
      track.judged = sliced == nullptr || options.budget >= kJudgingBudget;
      if (track.judged) verdict = print_judge->meet(i, frame_tracker.frame(), track, track.again);
      track.shown_reason = verdict.reason;
      if (resolve_overlap(i, detection, result)) {
        if (!track.judged) verdict.reason = before.last_reason;
        show(i, verdict, detection, result);
        continue;
      }
      reason = Reason::kOtherPrint;
      track = before;  // a recently lost one keeps its priority
    }
    // In the frame that lost it, the reason of the loss says more.
    if (track.frames_since_lost > 0 || progress(reason) > progress(track.last_reason))
      track.last_reason = reason;
  }
}

}  // namespace modar
