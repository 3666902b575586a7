// The loop's states: search for patterns, hold those that were found, tell why none is there.
#include "modar/pose_loop.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "formats/loop_record.hpp"
#include "plane_align.hpp"
#include "plane_matcher.hpp"

namespace modar {
namespace {

using loop::Fit;
using loop::LoopPattern;
using loop::PlaneMap;

constexpr int kFewestInliers = 8;
constexpr int kFewestMatches = 6;
constexpr int kRightCells = 8;     // cells that must show the pattern
constexpr int kRightPercent = 30;  // of the textured ones in view
constexpr int kMapInliers = 16;    // where no pose fits, and the map alone must convince
constexpr int kMapPercent = 50;
constexpr double kSmallSide = 24.0;   // pixels of the coarsest level that tracking starts on
constexpr double kMostZoom = 1.35;    // of the distance, from one frame to the next
constexpr double kFalling = 0.85;     // of the share of patches that a coarser level holds
constexpr double kSuspicious = 0.75;  // of the share that the frames before held

class Clock {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::milli> ms = now - last_;
    last_ = now;
    return ms.count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// What is known of a pattern from frame to frame.
struct Track {
  LoopPattern pattern;
  bool held = false;
  bool moving = false;  ///< two poses in sequence tell a motion
  Pose pose;
  Pose before;
  double share = 1;  ///< of the patches in view, how many hold; of the frames before
  Reason lost = Reason::kNoFeatures;
};

/// The pose that continues the motion from `before` to `now`.
Pose continued(const Pose& before, const Pose& now) {
  const glm::dmat3 turn = now.rotation * glm::transpose(before.rotation);
  Pose next;
  // Squared up again: a pose fed back frame by frame would double its rounding error each time.
  const glm::dmat3 turned = turn * now.rotation;
  next.rotation[0] = glm::normalize(turned[0]);
  next.rotation[1] =
      glm::normalize(turned[1] - next.rotation[0] * glm::dot(next.rotation[0], turned[1]));
  next.rotation[2] = glm::cross(next.rotation[0], next.rotation[1]);
  next.translation = now.translation + (now.translation - before.translation);
  if (!(next.translation.z > 0.0)) return now;
  return next;
}

}  // namespace

struct PoseLoop::State {
  Camera camera;
  PoseLoopOptions options;
  std::vector<Track> tracks;
  std::unique_ptr<LoopDescriber> describer;
  std::unique_ptr<loop::PlaneMatcher> matcher;
  int frames_to_search = 0;

  void step(const GrayImage& frame, TrackResult& result);
  bool follow(Track& track, Sighting& sighting);
  bool settle(const LoopPattern& pattern, Pose& pose, bool thorough, Fit& fit) const;
  int percent_right(const LoopPattern& pattern, const Pose& pose) const;
  bool shows(const LoopPattern& pattern, const Pose& pose, int percent) const;
  Reason search(Track& track, std::span<const LoopFeature> features, Sighting& sighting,
                TrackTimes& times);
  bool report(const Track& track, Sighting& sighting) const;
  Reason by_map(const Track& track, const loop::PlaneFind& found, Sighting& sighting) const;
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
  std::size_t most_codes = 0;
  const std::uint32_t count = bundle.patterns().size();
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto bytes = bundle.section(SectionType::kLoopRecord, i);
    if (bytes.empty()) continue;
    auto pattern = loop::view_loop_record(bytes, i);
    if (!pattern) return tl::unexpected(pattern.error());
    most_codes = std::max(most_codes, pattern->features.size());
    state->tracks.emplace_back().pattern = *pattern;
  }
  if (state->tracks.empty()) {
    return fail(ExitCode::kInvalidInput, "tracker.no-patterns", "",
                "the bundle holds no pattern with a record for this loop",
                "bake it with a pattern");
  }
  state->describer = LoopDescriber::create(camera.width, camera.height, options.detect);
  state->matcher = std::make_unique<loop::PlaneMatcher>(
      camera, static_cast<std::size_t>(options.detect.max_features), most_codes);
  return std::unique_ptr<PoseLoop>(new PoseLoop(std::move(state)));
}

void PoseLoop::reset() {
  for (Track& track : state_->tracks) track.held = track.moving = false;
  state_->frames_to_search = 0;
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

void PoseLoop::State::step(const GrayImage& frame, TrackResult& result) {
  result.visible.clear();
  result.reason = Reason::kNoFeatures;
  result.features = 0;
  result.times = {};
  Clock clock;
  describer->set_frame(frame);
  bool any_held = false;
  bool all_held = true;
  for (Track& track : tracks) {
    Sighting sighting;
    track.held = track.held && options.track;
    if (track.held && follow(track, sighting)) {
      result.visible.push_back(sighting);
      any_held = true;
    } else {
      all_held = false;
    }
  }
  result.times.pose = clock.lap();
  if (any_held) result.reason = Reason::kVisible;
  if (all_held || (any_held && --frames_to_search > 0)) return;
  frames_to_search = options.search_every;
  const auto features = describer->features();
  result.features = static_cast<int>(features.size());
  result.times.detect = clock.lap();
  for (Track& track : tracks) {
    if (track.held) continue;
    Sighting sighting;
    const Reason reason =
        features.empty() ? Reason::kNoFeatures : search(track, features, sighting, result.times);
    if (reason == Reason::kVisible) result.visible.push_back(sighting);
    const Reason told = progress(track.lost) > progress(reason) ? track.lost : reason;
    if (progress(told) > progress(result.reason)) result.reason = told;
    track.lost = Reason::kNoFeatures;
  }
  std::sort(result.visible.begin(), result.visible.end(),
            [](const Sighting& a, const Sighting& b) { return a.pattern < b.pattern; });
}

bool PoseLoop::State::report(const Track& track, Sighting& sighting) const {
  sighting.pattern = track.pattern.index;
  sighting.pose = track.pose;
  return loop::map_corners(track.pattern, loop::map_of_pose(track.pattern, camera, track.pose),
                           sighting.corners) &&
         loop::plausible(sighting.corners);
}

/// Photometric check: how many of the textured cells in view look as they should; 0 where too few
/// do to tell.
int PoseLoop::State::percent_right(const LoopPattern& pattern, const Pose& pose) const {
  const loop::Verdict verdict =
      loop::verify(pattern, loop::map_of_pose(pattern, camera, pose), describer->pyramid());
  return verdict.right >= kRightCells ? verdict.right * 100 / verdict.cells : 0;
}

bool PoseLoop::State::shows(const LoopPattern& pattern, const Pose& pose, int percent) const {
  return percent_right(pattern, pose) >= percent;
}

/// From a coarse level, on which the pattern is still some tens of pixels large, to the finest.
/// Answers true where the finest level holds, or under blur a coarser one that the whole picture
/// confirms.
bool PoseLoop::State::settle(const LoopPattern& pattern, Pose& pose, bool thorough,
                             Fit& fit) const {
  const auto pyramid = describer->pyramid();
  const int levels = static_cast<int>(pyramid.size());
  const loop::Resolution best =
      loop::finest(pattern, loop::map_of_pose(pattern, camera, pose), levels);
  int coarsest = best.frame_level;
  const int most = thorough ? 4 : 2;
  double side =
      std::max(pattern.width(), pattern.height()) / static_cast<double>(1 << best.pattern_level);
  while (coarsest + 1 < levels && coarsest - best.frame_level < most && side > 2 * kSmallSide &&
         best.pattern_level + coarsest + 1 - best.frame_level < pattern.level_count) {
    ++coarsest;
    side *= 0.5;
  }
  const double depth = pose.translation.z;
  Pose held = pose;
  bool found = false;
  for (int level = coarsest; level >= best.frame_level; --level) {
    Pose next = pose;
    const Fit now = loop::align(pattern, camera, pyramid, level, thorough ? 6 : 3, next);
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
  return shows(pattern, pose, kRightPercent);
}

/// A wrong focal length bends every pose, while the plane's own map still tells where it lies: its
/// corners, with the nearest pose, where much more speaks for it than a pose needs.
Reason PoseLoop::State::by_map(const Track& track, const loop::PlaneFind& found,
                               Sighting& sighting) const {
  const PlaneMap map{found.homography, loop::bending(camera)};
  const loop::Verdict verdict = loop::verify(track.pattern, map, describer->pyramid());
  const bool right = found.inliers >= kMapInliers && verdict.right >= 2 * kRightCells &&
                     verdict.right * 100 >= verdict.cells * kMapPercent;
  sighting.pattern = track.pattern.index;
  sighting.pose = track.pose;
  return right && loop::map_corners(track.pattern, map, sighting.corners) &&
                 loop::plausible(sighting.corners)
             ? Reason::kVisible
             : Reason::kFailedVerification;
}

bool PoseLoop::State::follow(Track& track, Sighting& sighting) {
  const Pose predicted = track.moving ? continued(track.before, track.pose) : track.pose;
  Pose pose = predicted;
  Fit fit;
  bool found = settle(track.pattern, pose, false, fit);
  if (!found || fit.share() < kSuspicious * track.share) {
    // From further away: where the motion says, then where it was, whichever shows more.
    int best = found ? percent_right(track.pattern, pose) : kRightPercent - 1;
    for (int attempt = 0; attempt < (track.moving ? 2 : 1); ++attempt) {
      Pose tried = attempt == 0 ? predicted : track.pose;
      Fit now;
      if (!settle(track.pattern, tried, true, now)) continue;
      const int right = percent_right(track.pattern, tried);
      if (right <= best) continue;
      best = right;
      pose = tried;
      fit = now;
      found = true;
      if (fit.share() >= kSuspicious * track.share) break;
    }
  }
  if (found) track.share = 0.8 * track.share + 0.2 * fit.share();
  const Track last = track;
  track.before = track.pose;
  track.pose = pose;
  track.moving = found;
  track.held = found && report(track, sighting);
  if (track.held) {
    sighting.matches = fit.visible;
    sighting.inliers = fit.held;
    return true;
  }
  track.lost = fit.visible < 6 ? Reason::kOutOfView : Reason::kLostByBlur;
  track.pose = last.pose;
  track.moving = false;
  return false;
}

Reason PoseLoop::State::search(Track& track, std::span<const LoopFeature> features,
                               Sighting& sighting, TrackTimes& times) {
  Clock clock;
  const loop::PlaneFind found = matcher->find(track.pattern, features);
  times.match += clock.lap();
  if (found.matches < kFewestMatches) return Reason::kFewMatches;
  if (found.inliers < kFewestInliers) return Reason::kNoGeometry;
  loop::FittedPose fitted;
  if (!loop::fit_pose(track.pattern, camera, found.homography, matcher->inlier_world(),
                      matcher->inlier_ideal(), fitted)) {
    times.homography += clock.lap();
    return Reason::kFailedVerification;
  }
  Track candidate = track;
  candidate.pose = fitted.pose;
  Fit fit;
  Pose refined = fitted.pose;
  if (settle(track.pattern, refined, false, fit)) candidate.pose = refined;
  const bool right = shows(track.pattern, candidate.pose, kRightPercent);
  times.homography += clock.lap();
  sighting.matches = found.matches;
  sighting.inliers = found.inliers;
  if (!right || !report(candidate, sighting)) return by_map(candidate, found, sighting);
  track.pose = candidate.pose;
  track.moving = false;
  track.held = true;
  track.share = 1.0;
  return Reason::kVisible;
}

}  // namespace modar
