// The loop's states: search for patterns, hold those that were found, tell why none is there.
#include "modar/pose_loop.hpp"

#include <algorithm>
#include <vector>

#include "follower.hpp"
#include "runtime/platform/lap_clock.hpp"
#include "seeker.hpp"

namespace modar {
namespace {

using loop::Finding;
using loop::Fit;
using loop::LoopPattern;
using loop::Track;
using loop::Want;

}  // namespace

struct PoseLoop::State {
  State(const Camera& seen_by, const PoseLoopOptions& how)
      : camera(seen_by), options(how), follower(seen_by, how.detect) {}

  Camera camera;
  PoseLoopOptions options;
  std::vector<LoopPattern> patterns;
  std::vector<Track> tracks;  ///< one a pattern
  loop::Follower follower;
  std::unique_ptr<loop::PatternSearch> search;  ///< on the caller's thread, or
  std::unique_ptr<loop::Seeker> seeker;         ///< on its own
  std::vector<Want> wants;
  loop::Findings findings;
  int frames_to_search = 0;
  bool stale = false;  ///< what the seeker finds was asked for before a reset

  void step(const GrayImage& frame, TrackResult& result);
  void follow_all(TrackResult& result);
  bool due(bool any_held);
  void adopt(TrackResult& result);
  bool take_up(const LoopPattern& pattern, Track& track, const Finding& finding,
               Sighting& sighting) const;
  bool prevails(std::size_t i, const Sighting& sighting, TrackResult& result);
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
    const auto bytes = bundle.section(SectionType::kLoopRecord, i);
    if (bytes.empty()) continue;
    auto pattern = loop::view_loop_pattern(bytes, i);
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
  state->findings.patterns.resize(state->patterns.size());
  if (options.apart) {
    state->seeker = std::make_unique<loop::Seeker>(camera, state->patterns, options.detect);
  } else {
    state->search = std::make_unique<loop::PatternSearch>(camera, state->patterns, options.detect);
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
    const bool lost = track.since_lost < loop::kLately;
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
  if (seeker != nullptr && seeker->take(findings, wants)) {
    if (!stale) adopt(result);
    stale = false;
  }
  result.times.pose = clock.lap();
  if (due(!result.visible.empty())) {
    if (seeker != nullptr) {
      seeker->start(frame, wants);
    } else {
      search->run(follower.eye(), wants, findings);
      adopt(result);
    }
  }
  for (const Track& track : tracks) {
    const Reason reason = track.held ? Reason::kVisible : track.told;
    if (progress(reason) > progress(result.reason)) result.reason = reason;
  }
  std::sort(result.visible.begin(), result.visible.end(),
            [](const Sighting& a, const Sighting& b) { return a.pattern < b.pattern; });
}

void PoseLoop::State::follow_all(TrackResult& result) {
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    Sighting sighting;
    if (!track.held) {
      track.since_lost = std::min(track.since_lost + 1, loop::kLately);
      continue;
    }
    track.held = options.track && follower.follow(patterns[i], track, sighting);
    if (track.held) {
      result.visible.push_back(sighting);
    } else {
      track.since_lost = options.track ? 0 : loop::kLately;
    }
  }
}

/// Answers whether a finding is visible in the present frame.
bool PoseLoop::State::take_up(const LoopPattern& pattern, Track& track, const Finding& finding,
                              Sighting& sighting) const {
  Track next;
  next.pose = finding.pose;
  next.by_map = finding.by_map;
  next.map = finding.map;
  sighting.matches = finding.matches;
  sighting.inliers = finding.inliers;
  if (seeker != nullptr) {
    // It was found in a frame that has gone by.
    Fit fit;
    const bool here =
        next.by_map
            ? loop::settle_map(pattern, follower.scene(), next.map, fit)
            : loop::settle(pattern, follower.scene(), loop::Reach::kFar, next.pose, fit) &&
                  loop::percent_right(pattern, follower.scene(), next.pose) >= loop::kRightPercent;
    if (!here) return false;
  }
  if (!follower.report(pattern, next, sighting)) return false;
  next.held = true;
  track = next;
  return true;
}

/// Prints of one series share so much that one is taken for the other: of those that claim the same
/// place, the frame decides. Answers whether pattern i, new, stays; then the others yield to it.
bool PoseLoop::State::prevails(std::size_t i, const Sighting& sighting, TrackResult& result) {
  const auto percent_of = [this](std::size_t which) {
    const Track& track = tracks[which];
    return track.by_map ? loop::map_percent(patterns[which], follower.scene(), track.map)
                        : loop::percent_right(patterns[which], follower.scene(), track.pose);
  };
  // None yields before it is known that the new one prevails against all.
  for (const bool yields : {false, true}) {
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      Sighting rival;
      const bool other = k != i && tracks[k].held && follower.report(patterns[k], tracks[k], rival);
      if (!other || !loop::same_place(rival.corners, sighting.corners)) continue;
      if (!yields) {
        if (percent_of(i) <= percent_of(k)) return false;
        continue;
      }
      tracks[k] = {};
      tracks[k].told = Reason::kFailedVerification;
      std::erase_if(result.visible, [&](const Sighting& s) { return s.pattern == rival.pattern; });
    }
  }
  return true;
}

/// Takes what a search found into the tracks and the frame's result.
void PoseLoop::State::adopt(TrackResult& result) {
  result.features = findings.features;
  result.times.detect = findings.times.detect;
  result.times.match = findings.times.match;
  result.times.homography = findings.times.homography;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    if (wants[i] == Want::kNo || track.held) continue;
    const Finding& finding = findings.patterns[i];
    const Track before = track;
    Sighting sighting;
    const bool here =
        finding.reason == Reason::kVisible && take_up(patterns[i], track, finding, sighting);
    if (here && prevails(i, sighting, result)) {
      result.visible.push_back(sighting);
      continue;
    }
    if (here) track = before;  // if it was lost a moment ago, it is still looked for first
    const Reason reason =
        finding.reason == Reason::kVisible ? Reason::kFailedVerification : finding.reason;
    // In the frame that lost it, what it was lost by tells more.
    if (track.since_lost > 0 || progress(reason) > progress(track.told)) track.told = reason;
  }
}

}  // namespace modar
