// The loop's states: search for patterns, hold those that were found, tell why none is there.
#include "modar/pose_loop.hpp"

#include <algorithm>
#include <vector>

#include "async_detector.hpp"
#include "frame_tracker.hpp"
#include "runtime/platform/lap_clock.hpp"

namespace modar {
namespace {

using tracker::DetectionCandidate;
using tracker::Fit;
using tracker::Track;
using tracker::TrackedPattern;
using tracker::Want;

}  // namespace

struct PoseLoop::State {
  State(const Camera& seen_by, const PoseLoopOptions& how)
      : camera(seen_by), options(how), follower(seen_by, how.detect) {}

  Camera camera;
  PoseLoopOptions options;
  std::vector<TrackedPattern> patterns;
  std::vector<Track> tracks;  ///< one a pattern
  tracker::FrameTracker follower;
  std::unique_ptr<tracker::PatternSearch> search;  ///< on the caller's thread, or
  std::unique_ptr<tracker::AsyncDetector> seeker;  ///< on its own
  std::vector<Want> wants;
  tracker::DetectionCandidates candidates;
  int frames_to_search = 0;
  bool stale = false;  ///< what the seeker finds was asked for before a reset

  void step(const GrayImage& frame, TrackResult& result);
  void follow_all(TrackResult& result);
  bool due(bool any_held);
  void adopt(TrackResult& result);
  bool take_up(const TrackedPattern& pattern, Track& track, const DetectionCandidate& candidate,
               Detection& detection) const;
  bool prevails(std::size_t i, const Detection& detection, TrackResult& result);
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
    auto pattern = tracker::view_loop_pattern(bytes, i);
    if (!pattern) return tl::unexpected(pattern.error());
    state->patterns.push_back(*pattern);
  }
  if (state->patterns.empty()) {
    return fail(ExitCode::kInvalidInput, "tracker.no-patterns", "",
                "the bundle holds no pattern with a record for this loop",
                "bake it with a pattern");
  }
  state->tracks.resize(state->patterns.size());
  state->wants.resize(state->patterns.size());
  state->candidates.patterns.resize(state->patterns.size());
  if (options.apart) {
    state->seeker =
        std::make_unique<tracker::AsyncDetector>(camera, state->patterns, options.detect);
  } else {
    state->search =
        std::make_unique<tracker::PatternSearch>(camera, state->patterns, options.detect);
  }
  return std::unique_ptr<PoseLoop>(new PoseLoop(std::move(state)));
}

void PoseLoop::reset() {
  for (Track& track : state_->tracks) track = {};
  state_->frames_to_search = 0;
  state_->stale = state_->seeker != nullptr && !state_->seeker->idle();
}

Result<TrackResult> PoseLoop::step(const GrayImage& frame) {
  TrackResult result;
  if (auto done = step(frame, result); !done) return tl::unexpected(done.error());
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

/// Whether this frame is searched for the patterns that are not held; sets what is wanted.
bool PoseLoop::State::due(bool any_held) {
  bool missing = false;
  bool lately = false;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    const bool lost = track.since_lost < tracker::kLately;
    wants[i] = track.held ? Want::kNo : lost ? Want::kFirst : Want::kYes;
    missing = missing || !track.held;
    lately = lately || (!track.held && lost);
  }
  --frames_to_search;
  // While one is tracked there is no haste to find others, but for those that were there just now.
  if (!missing || (any_held && !lately && frames_to_search > 0)) return false;
  if (seeker != nullptr && !seeker->idle()) return false;
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
  follower.set_frame(frame);
  follow_all(result);
  if (seeker != nullptr && seeker->take(candidates, wants)) {
    if (!stale) adopt(result);
    stale = false;
  }
  result.times.pose = clock.lap();
  if (due(!result.visible.empty())) {
    if (seeker != nullptr) {
      seeker->start(frame, wants);
    } else {
      search->run(follower.eye(), wants, candidates);
      adopt(result);
    }
  }
  for (const Track& track : tracks) {
    const Reason reason = track.held ? Reason::kVisible : track.told;
    if (progress(reason) > progress(result.reason)) result.reason = reason;
  }
  std::sort(result.visible.begin(), result.visible.end(),
            [](const Detection& a, const Detection& b) { return a.pattern < b.pattern; });
}

void PoseLoop::State::follow_all(TrackResult& result) {
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    Detection detection;
    if (!track.held) {
      track.since_lost = std::min(track.since_lost + 1, tracker::kLately);
      continue;
    }
    track.held = options.track && follower.follow(patterns[i], track, detection);
    if (track.held) {
      result.visible.push_back(detection);
    } else {
      track.since_lost = options.track ? 0 : tracker::kLately;
    }
  }
}

/// Answers whether a candidate is visible in the present frame.
bool PoseLoop::State::take_up(const TrackedPattern& pattern, Track& track,
                              const DetectionCandidate& candidate, Detection& detection) const {
  Track next;
  next.pose = candidate.pose;
  next.by_map = candidate.by_map;
  next.map = candidate.map;
  detection.matches = candidate.matches;
  detection.inliers = candidate.inliers;
  if (seeker != nullptr) {
    // It was found in a frame that has gone by.
    Fit fit;
    const bool here =
        next.by_map
            ? tracker::settle_map(pattern, follower.scene(), next.map, fit)
            : tracker::settle(pattern, follower.scene(), tracker::Reach::kFar, next.pose, fit) &&
                  tracker::percent_right(pattern, follower.scene(), next.pose) >=
                      tracker::kRightPercent;
    if (!here) return false;
  }
  if (!follower.report(pattern, next, detection)) return false;
  next.held = true;
  track = next;
  return true;
}

/// Prints of one series share so much that one is taken for the other: of those that claim the same
/// place, the frame decides. Answers whether pattern i, new, stays; then the others yield to it.
bool PoseLoop::State::prevails(std::size_t i, const Detection& detection, TrackResult& result) {
  const auto percent_of = [this](std::size_t which) {
    const Track& track = tracks[which];
    return track.by_map ? tracker::map_percent(patterns[which], follower.scene(), track.map)
                        : tracker::percent_right(patterns[which], follower.scene(), track.pose);
  };
  // None yields before it is known that the new one prevails against all.
  for (const bool yields : {false, true}) {
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      Detection rival;
      const bool other = k != i && tracks[k].held && follower.report(patterns[k], tracks[k], rival);
      if (!other || !tracker::same_place(rival.corners, detection.corners)) continue;
      if (!yields) {
        if (percent_of(i) <= percent_of(k)) return false;
        continue;
      }
      tracks[k] = {};
      tracks[k].told = Reason::kFailedVerification;
      std::erase_if(result.visible, [&](const Detection& s) { return s.pattern == rival.pattern; });
    }
  }
  return true;
}

/// Takes what a search found into the tracks and the frame's result.
void PoseLoop::State::adopt(TrackResult& result) {
  result.features = candidates.features;
  result.times.detect = candidates.times.detect;
  result.times.match = candidates.times.match;
  result.times.homography = candidates.times.homography;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    if (wants[i] == Want::kNo || track.held) continue;
    const DetectionCandidate& candidate = candidates.patterns[i];
    const Track before = track;
    Detection detection;
    const bool here =
        candidate.reason == Reason::kVisible && take_up(patterns[i], track, candidate, detection);
    if (here && prevails(i, detection, result)) {
      result.visible.push_back(detection);
      continue;
    }
    if (here) track = before;  // if it was lost a moment ago, it is still looked for first
    const Reason reason =
        candidate.reason == Reason::kVisible ? Reason::kFailedVerification : candidate.reason;
    // In the frame that lost it, what it was lost by tells more.
    if (track.since_lost > 0 || progress(reason) > progress(track.told)) track.told = reason;
  }
}

}  // namespace modar
