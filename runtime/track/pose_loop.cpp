// The loop's states: search for patterns, hold those that were found, tell why none is there.
#include "modar/pose_loop.hpp"

#include <algorithm>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "motion.hpp"
#include "runtime/platform/lap_clock.hpp"
#include "seeker.hpp"

namespace modar {
namespace {

using loop::Finding;
using loop::Fit;
using loop::LoopPattern;
using loop::PlaneMap;
using loop::Want;

constexpr double kSuspicious = 0.75;  // of the share that the frames before held
constexpr double kBlurringWay = 4.0;  // pixels from frame to frame
constexpr double kFarWay = 80.0;      // the same: what moves so far was not even found
constexpr double kClearer = 0.02;     // likeness that smeared templates must gain
constexpr double kUnclear = 0.96;     // of the likeness before
constexpr double kForgetting = 0.99;  // of that, a frame
constexpr int kLately = 60;           // frames for which a lost pattern is looked for first

/// What is known of a pattern from frame to frame.
struct Track {
  bool held = false;
  bool by_map = false;  ///< no pose of the camera explains it: its own map is followed
  bool moving = false;  ///< two poses in sequence tell a motion
  Pose pose;
  Pose before;
  PlaneMap map;         ///< where by_map
  double share = 1;     ///< of the patches in view, how many hold; of the frames before
  double likeness = 0;  ///< of the patches, of the sharp frames before
  int since_lost = kLately;
  Reason told = Reason::kNoFeatures;  ///< by the last search
};

}  // namespace

struct PoseLoop::State {
  Camera camera;
  PoseLoopOptions options;
  std::vector<LoopPattern> patterns;
  std::vector<Track> tracks;  ///< one a pattern
  std::unique_ptr<LoopDescriber> eye;
  std::unique_ptr<loop::PatchCache> patches = std::make_unique<loop::PatchCache>();
  std::unique_ptr<loop::PatternSearch> search;  ///< on the caller's thread, or
  std::unique_ptr<loop::Seeker> seeker;         ///< on its own
  std::vector<Want> wants;
  loop::Findings findings;
  int frames_to_search = 0;
  double smear = 0;    ///< share of a frame's time that the shutter is open, as blur tells
  bool stale = false;  ///< what the seeker finds was asked for before a reset

  void step(const GrayImage& frame, TrackResult& result);
  [[nodiscard]] loop::Scene scene() const {
    return {camera, eye->pyramid(), loop::kernels(options.detect.simd), *patches};
  }
  void follow_all(TrackResult& result);
  bool follow(const LoopPattern& pattern, Track& track, Sighting& sighting);
  bool unsmear(const LoopPattern& pattern, const Track& track, const Pose& predicted, Pose& pose,
               Fit& fit);
  bool follow_pose(const LoopPattern& pattern, Track& track, Fit& fit);
  bool find_again(const LoopPattern& pattern, const Track& track, const Pose& predicted, Pose& pose,
                  Fit& fit) const;
  bool report(const LoopPattern& pattern, const Track& track, Sighting& sighting) const;
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
  auto state = std::make_unique<State>();
  state->camera = camera;
  state->options = options;
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
  state->eye = LoopDescriber::create(camera.width, camera.height, options.detect);
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
    const bool lost = track.since_lost < kLately;
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
  eye->set_frame(frame);
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
      search->run(*eye, wants, findings);
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
      track.since_lost = std::min(track.since_lost + 1, kLately);
      continue;
    }
    track.held = options.track && follow(patterns[i], track, sighting);
    if (track.held) {
      result.visible.push_back(sighting);
    } else {
      track.since_lost = options.track ? 0 : kLately;
    }
  }
}

bool PoseLoop::State::report(const LoopPattern& pattern, const Track& track,
                             Sighting& sighting) const {
  sighting.pattern = pattern.index;
  sighting.pose = track.pose;
  const PlaneMap map = track.by_map ? track.map : loop::map_of_pose(pattern, camera, track.pose);
  return loop::map_corners(pattern, map, sighting.corners) && loop::plausible(sighting.corners);
}

/// From further away: where the motion says, then where it was, whichever shows more.
bool PoseLoop::State::find_again(const LoopPattern& pattern, const Track& track,
                                 const Pose& predicted, Pose& pose, Fit& fit) const {
  bool found = fit.held > 0;
  int best = found ? loop::percent_right(pattern, scene(), pose) : loop::kRightPercent - 1;
  for (int attempt = 0; attempt < (track.moving ? 2 : 1); ++attempt) {
    Pose tried = attempt == 0 ? predicted : track.pose;
    Fit now;
    if (!loop::settle(pattern, scene(), loop::Reach::kFar, tried, now)) continue;
    const int right = loop::percent_right(pattern, scene(), tried);
    if (right <= best) continue;
    best = right;
    pose = tried;
    fit = now;
    found = true;
    if (fit.share() >= kSuspicious * track.share) break;
  }
  return found;
}

/// Where a moving pattern is seen less clearly than before: whether it is blurred by that motion,
/// how much, and where it lies with templates that are blurred alike. Answers whether that fits
/// better.
bool PoseLoop::State::unsmear(const LoopPattern& pattern, const Track& track, const Pose& predicted,
                              Pose& pose, Fit& fit) {
  const auto corner = [&](const Pose& at) {
    bool ahead = false;
    return loop::map_of_pose(pattern, camera, at)
        .at({0.5 * pattern.width(), 0.5 * pattern.height()}, ahead);
  };
  const double way = glm::length(corner(pose) - corner(track.pose));
  if (!track.moving || !(fit.held > 0) || way < kBlurringWay || way > kFarWay) return false;
  if (smear == 0.0 && fit.likeness > kUnclear * track.likeness) return false;
  loop::Smear how{track.pose, 0.0};
  loop::Scene blurred = scene();
  blurred.smear = &how;
  // On a level where a wrong place of a few pixels matters little.
  const int level = loop::finest(pattern, loop::map_of_pose(pattern, camera, pose),
                                 static_cast<int>(blurred.pyramid.size()))
                        .frame_level +
                    1;
  if (level >= static_cast<int>(blurred.pyramid.size())) return false;
  double best = 0.0;
  double likeness = loop::look(pattern, scene(), level, pose).likeness + kClearer;
  for (int quarter = 1; quarter <= 4; ++quarter) {
    how.share = 0.25 * quarter;
    const double now = loop::look(pattern, blurred, level, pose).likeness;
    if (now <= likeness) continue;
    likeness = now;
    best = how.share;
  }
  smear = best;
  how.share = best;
  if (best == 0.0) return false;
  Pose tried = predicted;
  Fit seen;
  if (!loop::settle(pattern, blurred, loop::Reach::kFrame, tried, seen) ||
      seen.likeness <= fit.likeness) {
    return false;
  }
  pose = tried;
  fit = seen;
  return true;
}

bool PoseLoop::State::follow_pose(const LoopPattern& pattern, Track& track, Fit& fit) {
  const Pose predicted = track.moving ? loop::continued(track.before, track.pose) : track.pose;
  Pose pose = predicted;
  bool found = loop::settle(pattern, scene(), loop::Reach::kFrame, pose, fit);
  const bool unsmeared = unsmear(pattern, track, predicted, pose, fit);
  found = found || unsmeared;
  if (!unsmeared && fit.likeness > track.likeness) track.likeness = fit.likeness;
  track.likeness *= kForgetting;
  if (!found || (!unsmeared && fit.share() < kSuspicious * track.share)) {
    const Fit seen = fit;
    if (!found) fit = {};
    found = find_again(pattern, track, predicted, pose, fit);
    if (!found) fit = seen;
  }
  if (!found) return false;
  track.share = 0.8 * track.share + 0.2 * fit.share();
  track.before = track.pose;
  track.pose = pose;
  track.moving = true;
  return true;
}

bool PoseLoop::State::follow(const LoopPattern& pattern, Track& track, Sighting& sighting) {
  const Track last = track;
  Fit fit;
  bool found = false;
  if (track.by_map) {
    found = loop::settle_map(pattern, scene(), track.map, fit);
    const auto pose = loop::nearest_pose(pattern, camera, track.map);
    found = found && pose.has_value();
    if (found) track.pose = *pose;
  } else {
    found = follow_pose(pattern, track, fit);
  }
  if (found && report(pattern, track, sighting)) {
    sighting.matches = fit.visible;
    sighting.inliers = fit.held;
    return true;
  }
  track = last;
  track.moving = false;
  const Pose expected = last.moving ? loop::continued(last.before, last.pose) : last.pose;
  const PlaneMap map = last.by_map ? last.map : loop::map_of_pose(pattern, camera, expected);
  track.told = loop::in_view(pattern, map, camera) ? Reason::kLostByBlur : Reason::kOutOfView;
  return false;
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
        next.by_map ? loop::settle_map(pattern, scene(), next.map, fit)
                    : loop::settle(pattern, scene(), loop::Reach::kFar, next.pose, fit) &&
                          loop::percent_right(pattern, scene(), next.pose) >= loop::kRightPercent;
    if (!here) return false;
  }
  if (!report(pattern, next, sighting)) return false;
  next.held = true;
  track = next;
  return true;
}

/// Prints of one series share so much that one is taken for the other: of those that claim the same
/// place, the frame decides. Answers whether pattern i, new, stays; others may yield to it.
bool PoseLoop::State::prevails(std::size_t i, const Sighting& sighting, TrackResult& result) {
  const auto percent_of = [this](std::size_t which) {
    const Track& track = tracks[which];
    return track.by_map ? loop::map_percent(patterns[which], scene(), track.map)
                        : loop::percent_right(patterns[which], scene(), track.pose);
  };
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    Sighting rival;
    const bool other = k != i && tracks[k].held && report(patterns[k], tracks[k], rival);
    if (!other || !loop::same_place(rival.corners, sighting.corners)) continue;
    if (percent_of(i) <= percent_of(k)) return false;
    tracks[k] = {};
    tracks[k].told = Reason::kFailedVerification;
    std::erase_if(result.visible, [&](const Sighting& s) { return s.pattern == rival.pattern; });
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
    Sighting sighting;
    const bool here =
        finding.reason == Reason::kVisible && take_up(patterns[i], track, finding, sighting);
    if (here && prevails(i, sighting, result)) {
      result.visible.push_back(sighting);
      continue;
    }
    if (here) track = {};
    const Reason reason =
        finding.reason == Reason::kVisible ? Reason::kFailedVerification : finding.reason;
    // In the frame that lost it, what it was lost by tells more.
    if (track.since_lost > 0 || progress(reason) > progress(track.told)) track.told = reason;
  }
}

}  // namespace modar
