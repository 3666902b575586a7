// The states of the loop: search for patterns, track those found, give the reason if there is none.
#include "modar/pose_loop.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "camera_estimator.hpp"
#include "frame_tracker.hpp"
#include "pattern_search.hpp"
#include "print_verifier.hpp"
#include "runtime/platform/lap_clock.hpp"
#include "surroundings.hpp"

namespace modar {
namespace {

using tracker::DetectionCandidate;
using tracker::PatchFit;
using tracker::PrintVerifier;
using tracker::SearchPriority;
using tracker::Track;
using tracker::TrackedPattern;

// Budget of a frame, in millions of instructions, from which a find is refined and verified in the
// frame that completes the search. With a smaller budget the next frame does both.
constexpr int kVerifyingBudget = 20;

// When to test whether a pose has slipped off its pattern: if the prediction missed by this many
// pixels, unless at least kSurePatches patches fit, and kSurePercent of those in view. A pattern
// that is found again within kRemembered frames of its loss is tested as well. Testing more often
// costs time (it compares all cells) and rejects finds in pictures that have become less sharp;
// testing less often shows wrong poses. Not measured.
constexpr double kSlippingSurprise = 2.5;
constexpr int kSurePatches = 30;
constexpr int kSurePercent = 95;
constexpr int kRemembered = 10;

// Frames between attempts to find a covered pattern where its surroundings place it: trades the
// time of an attempt, about that of tracking, for how soon the pattern is measured again.
constexpr int kLookEvery = 4;

// Frames between measurements of a plane for the camera's estimate: trades their time, half of that
// of tracking, for how soon the camera is known. The next one comes after kMeasureSoon frames if
// the last one moved a corner by kMovedShape pixels: with a wrong focal length, the shape lags
// behind a rotation. A plane counts as flat and uncovered if at least kFlatPatches patches fit, and
// kFlatRatio of those in view.
constexpr int kMeasureEvery = 5;
constexpr int kMeasureSoon = 2;
constexpr double kMovedShape = 0.4;
constexpr int kFlatPatches = 24;
constexpr double kFlatRatio = 0.6;
// Iterations of a free homography that starts at the pose, and the weight of a new measurement in
// the shape: a smaller one lags, a larger one jitters.
constexpr int kMeasuringSteps = 2;
constexpr double kNewShape = 0.7;
// Relative change of the focal length after which the learned surroundings are discarded.
constexpr double kLearnedAnew = 0.01;

/// A correction of the shown pose that is spread over several frames.
struct PoseBlend {
  double share = 0;       ///< of the correction that is not yet applied, 1 to 0
  double step = 0;        ///< decrease of `share` per frame
  glm::dvec3 rotation{};  ///< rotation vector, radians
  glm::dvec3 translation{};
};

bool shows_flat(const PatchFit& fit) {
  return fit.inliers >= kFlatPatches && (fit.inlier_ratio() >= kFlatRatio || fit.covered());
}

/// Largest distance between corresponding corners, pixels.
double way_of(const std::array<glm::dvec2, 4>& a, const std::array<glm::dvec2, 4>& b) {
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) most = std::max(most, glm::length(a[i] - b[i]));
  return most;
}

/// Four points of a pattern, the corners of the part of it that is in the frame, with their pixels;
/// false if that part is too small.
bool places_in_view(const TrackedPattern& pattern, const tracker::PlaneMap& map,
                    const Camera& camera, tracker::CameraEstimator::View& view) {
  constexpr double kLeast = 0.4;  // of each side
  constexpr double kStep = 0.1;
  const double longest = std::max(pattern.width(), pattern.height());
  glm::dvec2 low{0.05, 0.05};  // shares of width and height
  glm::dvec2 high{0.95, 0.95};
  for (;;) {
    const std::array<glm::dvec2, 4> shares = {low, glm::dvec2{high.x, low.y}, high,
                                              glm::dvec2{low.x, high.y}};
    std::array<bool, 4> inside{};
    for (std::size_t i = 0; i < 4; ++i) {
      const glm::dvec2 pixel{shares[i].x * pattern.width() - 0.5,
                             shares[i].y * pattern.height() - 0.5};
      const glm::dvec2 seen = map.at(pixel, inside[i]);
      inside[i] = inside[i] && seen.x >= 0 && seen.y >= 0 && seen.x < camera.width &&
                  seen.y < camera.height;
      view.world[i] = {(2.0 * shares[i].x - 1.0) * pattern.width() / longest,
                       (1.0 - 2.0 * shares[i].y) * pattern.height() / longest};
      view.pixels[i] = undistort(camera, seen);
    }
    // The side whose places are out goes inwards; of a single corner, both of its sides.
    const bool left = !(inside[0] && inside[3]);
    const bool right = !(inside[1] && inside[2]);
    const bool top = !(inside[0] && inside[1]);
    const bool bottom = !(inside[2] && inside[3]);
    if (!left && !right) return true;
    if (left != right) (left ? low.x : high.x) += left ? kStep : -kStep;
    if (top != bottom) (top ? low.y : high.y) += top ? kStep : -kStep;
    if (left == right && top == bottom) {
      low += kStep;
      high -= kStep;
    }
    if (high.x - low.x < kLeast || high.y - low.y < kLeast) return false;
  }
}

}  // namespace

struct PoseLoop::State {
  State(const Camera& seen_by, const PoseLoopOptions& how)
      : camera(seen_by), search_camera(seen_by), options(how), frame_tracker(camera, how.detect) {}

  Camera camera;
  Camera search_camera;
  PoseLoopOptions options;
  std::vector<TrackedPattern> patterns;
  std::vector<TrackedPattern> searched;  ///< copies for the search
  std::vector<Track> tracks;             ///< one per pattern
  std::unique_ptr<PrintVerifier> print_verifier;
  tracker::FrameTracker frame_tracker;
  std::unique_ptr<tracker::CameraEstimator> estimator;  ///< if the camera is a guess
  double learned_focal = 0;                         ///< with which the surroundings were learned
  std::unique_ptr<tracker::PatternSearch> search;   ///< searches on the caller's thread,
  std::unique_ptr<tracker::AsyncDetector> async;    ///< on a separate thread,
  std::unique_ptr<tracker::SlicedDetector> sliced;  ///< or in slices within the budget
  std::vector<SearchPriority> priorities;
  tracker::DetectionCandidates candidates;
  int frames_to_search = 0;
  bool discard_found = false;  ///< the running search started before a reset
  std::unique_ptr<tracker::Surroundings> surroundings;  ///< of the pattern `anchor`
  std::size_t anchor = 0;
  double usual_patches = 0;  ///< patches of it that fitted in the last second
  int frames_unseen = 0;
  bool extending = false;  ///< the last frame followed the surroundings
  bool guessed = false;    ///< and showed the pose that they gave
  PoseBlend blend;
  std::optional<std::array<glm::dvec2, 4>>
      last_offset;                 ///< by which the last frame saw its corners
                                   ///< beside where the surroundings had them
  std::optional<glm::dvec3> turn;  ///< of what the camera sees, since the last frame
  [[nodiscard]] const glm::dvec3* turn_seen() const { return turn.has_value() ? &*turn : nullptr; }

  void step(const GrayImage& frame, TrackResult& result);
  void track_all(TrackResult& result);
  void measure(std::size_t i, Detection& detection);
  bool view_plane(const TrackedPattern& plane, const Pose& pose,
                  tracker::CameraEstimator::View& view, tracker::PlaneSplit& split) const;
  bool measure_first(std::size_t i, tracker::CameraEstimator::View& view);
  bool measure_again(std::size_t i, tracker::CameraEstimator::View& view);
  void apply_estimate();
  void place_pictures(TrackResult& result) const;
  void advance_search(TrackResult& result);
  bool search_due(bool any_tracked);
  void accept(TrackResult& result);
  /// Whether finds are refined, verified and shown in the frame that completes the search.
  [[nodiscard]] bool verifies_finds() const {
    return sliced == nullptr || options.budget >= kVerifyingBudget;
  }
  bool start_track(const TrackedPattern& pattern, Track& track, const DetectionCandidate& candidate,
                   Detection& detection) const;
  [[nodiscard]] bool has_slipped(std::size_t i, const Track& track) const;
  bool resolve_overlap(std::size_t i, const Detection& detection, TrackResult& result);
  bool show(std::size_t i, const PrintVerifier::Verification& verification, Detection& detection,
            TrackResult& result);
  bool switch_pattern(std::size_t from, std::size_t to, Detection& detection);
  void extend(TrackResult& result);
  Detection* choose_anchor(TrackResult& result);
  [[nodiscard]] bool doubts(const Detection& seen) const;
  bool follow_surroundings(bool shown, Detection& detection);
  void find_again(const Pose& followed);
  bool corners_of(const Pose& pose, std::array<glm::dvec2, 4>& corners) const;
  bool seen_twice(const Detection& seen, const Detection& followed);
  void smooth_correction(const tracker::ExtendedPose& extended,
                         const std::array<glm::dvec2, 4>& corners);
  [[nodiscard]] Pose blended(const Pose& pose) const;
  void start_blend(const Pose& from, const Pose& to);
  void continue_blend(Detection& detection);
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
    MODAR_ASSIGN(
        const TrackedPattern pattern,
        tracker::view_tracked_pattern(bytes, i, bundle.section(SectionType::kPatternShape, i)));
    state->patterns.push_back(pattern);
  }
  if (state->patterns.empty()) {
    return fail(ExitCode::kInvalidInput, "tracker.no-patterns", "",
                "the bundle holds no pattern with a record for this loop",
                "bake it with a pattern");
  }
  state->searched = state->patterns;
  state->tracks.resize(state->patterns.size());
  state->print_verifier =
      std::make_unique<PrintVerifier>(state->patterns, !options.estimate_camera);
  state->priorities.resize(state->patterns.size());
  state->candidates.patterns.resize(state->patterns.size());
  if (options.async_search) {
    state->async = std::make_unique<tracker::AsyncDetector>(state->search_camera, state->searched,
                                                            options.detect);
  } else if (options.budget > 0) {
    state->sliced = std::make_unique<tracker::SlicedDetector>(state->search_camera, state->searched,
                                                              options.detect);
  } else {
    state->search = std::make_unique<tracker::PatternSearch>(state->search_camera, state->searched,
                                                             options.detect);
  }
  if (options.extended) {
    state->surroundings = std::make_unique<tracker::Surroundings>(state->camera);
  }
  if (options.estimate_camera) {
    state->estimator = std::make_unique<tracker::CameraEstimator>(camera, state->patterns.size());
  }
  return std::unique_ptr<PoseLoop>(new PoseLoop(std::move(state)));
}

void PoseLoop::set_turn(const glm::dvec3& rotation) {
  state_->turn = -rotation;
}

void PoseLoop::reset() {
  for (Track& track : state_->tracks) track = {};
  state_->frames_to_search = 0;
  if (state_->sliced != nullptr) state_->sliced->cancel();
  state_->discard_found = state_->async != nullptr && !state_->async->idle();
  if (state_->surroundings != nullptr) state_->surroundings->clear();
  state_->extending = state_->guessed = false;
  state_->blend = {};
  state_->last_offset.reset();
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
  // While one is tracked, only patterns lost a moment ago are worth a search in every frame; while
  // the surroundings say where one is, it is looked for there.
  const bool waits = extending || (any_tracked && !recently);
  if (!missing || (waits && frames_to_search > 0)) return false;
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
  if (estimator != nullptr) apply_estimate();
  result.camera = estimator != nullptr ? estimator->estimate() : CameraEstimate{camera.fx};
  result.camera.focal = camera.fx;
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
  if (surroundings != nullptr) extend(result);
  if (estimator != nullptr) place_pictures(result);
  turn.reset();
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
  const std::int64_t extended = extending ? 1 : 0;  // costs no more than a pattern
  const std::int64_t work =
      std::int64_t{1'000'000} * options.budget - kFrameCost - kTrackCost * (tracked + extended + 1);
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
    const bool sure = detection.inliers >= kSurePatches &&
                      detection.inliers * 100 >= detection.matches * kSurePercent;
    if (track.tracked && !sure && track.surprise >= kSlippingSurprise && has_slipped(i, track)) {
      track.tracked = track.has_motion = false;
      track.last_reason = Reason::kLostByBlur;
    }
    if (track.tracked && track.doubts > 0) {
      track.shown_reason = Reason::kLostByBlur;
    } else if (track.tracked) {
      measure(i, detection);
      const auto frame = frame_tracker.frame();
      show(i,
           track.verified ? print_verifier->verify_tracked(i, frame, track)
                          : print_verifier->verify_found(i, frame, track, track.again),
           detection, result);
      track.verified = true;
    } else {
      track.frames_since_lost = options.track ? 0 : tracker::kRecentFrames;
    }
  }
}

/// Measures a tracked flat pattern's free homography: what it says of the camera, and what a pose
/// leaves of it, since no camera explains the pictures of a stabilised or distorting one.
void PoseLoop::State::measure(std::size_t i, Detection& detection) {
  Track& track = tracks[i];
  if (estimator == nullptr || !patterns[i].surface.flat() || track.doubts > 0) return;
  if (--track.frames_to_measure > 0 && track.measured) return;
  track.frames_to_measure = kMeasureEvery;
  tracker::CameraEstimator::View view{i, {}, {}, track.pose};
  if (!(track.measured ? measure_again(i, view) : measure_first(i, view))) return;
  // Corners beyond what covers a print would say more of the camera than they know.
  const bool open = detection.inliers >= kFlatRatio * detection.matches;
  if (open && estimator->is_new(i, view.pixels)) estimator->add(view);
  const std::array<glm::dvec2, 4> before = detection.corners;
  frame_tracker.locate(patterns[i], track, detection);
  if (!track.measured || way_of(before, detection.corners) > kMovedShape)
    track.frames_to_measure = kMeasureSoon;
  track.measured = true;
  track.homography_only = false;
}

/// Goes to a pattern's plane at a pose; false if the camera could not see it there, or sees too
/// little of it.
bool PoseLoop::State::view_plane(const TrackedPattern& plane, const Pose& pose,
                                 tracker::CameraEstimator::View& view,
                                 tracker::PlaneSplit& split) const {
  const tracker::PlaneMap map = tracker::map_of_pose(plane, camera, pose);
  const auto known = tracker::split_map(plane, camera, map, estimator->aspect(view.pattern));
  if (!known || !places_in_view(plane, map, camera, view)) return false;
  split = *known;
  view.pose = split.pose;
  return true;
}

/// From where a pose, or a map, was found.
bool PoseLoop::State::measure_first(std::size_t i, tracker::CameraEstimator::View& view) {
  Track& track = tracks[i];
  TrackedPattern plane = patterns[i];
  Pose pose = track.pose;
  tracker::PlaneSplit split;
  if (track.homography_only) {
    const auto known = tracker::split_map(plane, camera, track.map, estimator->aspect(i));
    if (!known) return false;
    plane.shape = known->shape;
    pose = known->pose;
  }
  PatchFit fit;
  if (!tracker::refine_plane(plane, frame_tracker.frame(), pose, fit) || !shows_flat(fit) ||
      !view_plane(plane, pose, view, split)) {
    return false;
  }
  track.pose = split.pose;
  patterns[i].shape = split.shape;
  return true;
}

/// From where tracking has it.
bool PoseLoop::State::measure_again(std::size_t i, tracker::CameraEstimator::View& view) {
  Track& track = tracks[i];
  TrackedPattern plane = patterns[i];
  Pose pose = track.pose;
  tracker::PlaneChange change;
  tracker::PlaneSplit split;
  const auto frame = frame_tracker.frame();
  const tracker::PlaneMap map = tracker::map_of_pose(plane, camera, pose);
  const int level = tracker::finest(plane, map, static_cast<int>(frame.pyramid.size())).frame_level;
  if (!places_in_view(plane, map, camera, view) ||
      !shows_flat(tracker::align_plane(plane, frame, level, kMeasuringSteps, tracker::kMaxPatches,
                                       pose, change)) ||
      !view_plane(plane, pose, view, split)) {
    return false;
  }
  // Tracking weighs patches otherwise: it goes on from its own pose, as the shape moves that, and
  // its motion from where that shape would have had the pattern a frame before.
  const Pose moved = change.pose_after(track.pose, kNewShape);
  const glm::dmat3 undo = glm::transpose(track.pose.rotation);
  track.previous.translation +=
      track.previous.rotation * (undo * (moved.translation - track.pose.translation));
  track.previous.rotation = track.previous.rotation * undo * moved.rotation;
  track.pose = moved;
  patterns[i].shape = change.shape_after(patterns[i].shape, kNewShape);
  return true;
}

/// Goes on with the focal length and the aspects that the views so far say.
void PoseLoop::State::apply_estimate() {
  const double focal = estimator->estimate().focal;
  const Camera before = camera;
  camera.fx = camera.fy = focal;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    TrackedPattern& pattern = patterns[i];
    if (!pattern.surface.flat()) continue;
    const glm::dmat2 alone(1.0, 0.0, 0.0, estimator->aspect(i));
    Track& track = tracks[i];
    const auto plane = tracker::split_map(
        pattern, camera, tracker::map_of_pose(pattern, before, track.pose), alone[1][1]);
    if (!track.tracked || track.homography_only || !plane) {
      pattern.shape = alone;
      track.measured = false;
      continue;
    }
    if (track.has_motion) {
      const auto previous = tracker::split_map(
          pattern, camera, tracker::map_of_pose(pattern, before, track.previous), alone[1][1]);
      track.has_motion = previous.has_value();
      if (previous) track.previous = previous->pose;
    }
    track.pose = plane->pose;
    pattern.shape = plane->shape;
  }
  // The thread of a search reads its own copies.
  const bool idle = async != nullptr ? async->idle() : sliced == nullptr || sliced->idle();
  for (std::size_t i = 0; idle && i < patterns.size(); ++i) {
    searched[i].shape[1][1] = searched[i].surface.flat() ? estimator->aspect(i) : 1.0;
  }
  if (idle) search_camera = camera;
  if (surroundings != nullptr && std::abs(focal - learned_focal) > kLearnedAnew * learned_focal) {
    surroundings->clear();
    learned_focal = focal;
  }
}

/// Poses as others use them, in place of those by which the loop splits its maps.
void PoseLoop::State::place_pictures(TrackResult& result) const {
  for (Detection& seen : result.visible) {
    const auto which =
        std::find_if(patterns.begin(), patterns.end(),
                     [&](const TrackedPattern& pattern) { return pattern.index == seen.pattern; });
    if (which == patterns.end() || !which->surface.flat()) continue;
    const auto i = static_cast<std::size_t>(which - patterns.begin());
    const tracker::DrawnPose drawn =
        tracker::drawn_pose(*which, camera, seen.pose, estimator->aspect(i));
    seen.pose = drawn.pose;
    seen.stretch = drawn.stretch;
  }
}

bool PoseLoop::State::has_slipped(std::size_t i, const Track& track) const {
  return track.verified && !track.homography_only &&
         print_verifier->has_slipped(i, frame_tracker.frame(), track);
}

/// Adds a tracked pattern, or the pattern that the verifier found in its place, to the result,
/// unless its verification failed. Returns whether it was added.
bool PoseLoop::State::show(std::size_t i, const PrintVerifier::Verification& verification,
                           Detection& detection, TrackResult& result) {
  tracks[i].shown_reason = verification.reason;
  detection.agreeing = verification.agreeing;
  detection.likeness = verification.likeness;
  if (verification.actual_pattern >= 0 &&
      switch_pattern(i, static_cast<std::size_t>(verification.actual_pattern), detection)) {
    result.visible.push_back(detection);
    return true;
  }
  if (verification.reason != Reason::kVisible) return false;
  result.visible.push_back(detection);
  return true;
}

/// The frame shows another pattern in the place of a tracked one: tracks that pattern instead.
bool PoseLoop::State::switch_pattern(std::size_t from, std::size_t to, Detection& detection) {
  if (tracks[to].tracked || tracks[from].homography_only) return false;
  const TrackedPattern& pattern = patterns[to];
  Track next;
  next.pose = tracks[from].pose;
  PatchFit fit;
  Detection switched = detection;
  if (!tracker::refine(pattern, frame_tracker.frame(), tracker::SearchRadius::kClose, next.pose,
                       fit) ||
      !frame_tracker.locate(pattern, next, switched)) {
    return false;
  }
  const PrintVerifier::Verification verification =
      print_verifier->verify_found(to, frame_tracker.frame(), next, false);
  if (verification.reason != Reason::kVisible || verification.actual_pattern >= 0) return false;
  switched.agreeing = verification.agreeing;
  switched.likeness = verification.likeness;
  switched.matches = fit.visible;
  switched.inliers = fit.inliers;
  next.tracked = next.verified = true;
  tracks[to] = next;
  tracks[from] = {};
  tracks[from].last_reason = Reason::kOtherPrint;
  detection = switched;
  return true;
}

/// Starts a track; false if the candidate is not visible in the current frame.
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
    const bool here =
        next.homography_only
            ? tracker::refine_map(pattern, frame_tracker.frame(), next.map, fit)
            : tracker::refine(pattern, frame_tracker.frame(), tracker::SearchRadius::kFar,
                              next.pose, fit, verifies_finds()) &&
                  tracker::photometric_percent(pattern, frame_tracker.frame(), next.pose) >=
                      (fit.close >= tracker::kClosePatches ? tracker::kClosePatchesPercent
                                                           : tracker::kMinPercent);
    if (!here) return false;
  }
  if (!frame_tracker.locate(pattern, next, detection)) return false;
  next.tracked = true;
  track = next;
  return true;
}

/// Prints of one series are so similar that one is mistaken for the other: of patterns in the same
/// place, only the one that matches the picture best stays. Returns whether the new pattern i
/// stays; the others are then dropped.
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
      Detection other_detection;
      const bool other = k != i && tracks[k].tracked &&
                         frame_tracker.locate(patterns[k], tracks[k], other_detection);
      if (!other ||
          !tracker::same_place(frame_tracker.place(patterns[k], tracks[k], other_detection),
                               frame_tracker.place(patterns[i], tracks[i], detection))) {
        continue;
      }
      if (!drop) {
        if (percent_of(i) <= percent_of(k)) return false;
        continue;
      }
      tracks[k] = {};
      tracks[k].last_reason = Reason::kFailedVerification;
      std::erase_if(result.visible,
                    [&](const Detection& s) { return s.pattern == other_detection.pattern; });
    }
  }
  return true;
}

/// Starts tracks from the candidates of a search, and adds them to the frame's result.
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
    bool here = candidate.reason == Reason::kVisible &&
                start_track(patterns[i], track, candidate, detection);
    if (here && before.verified && before.frames_since_lost < kRemembered &&
        print_verifier->has_slipped(i, frame_tracker.frame(), track)) {
      here = false;
      track = before;
    }
    Reason reason =
        candidate.reason == Reason::kVisible ? Reason::kFailedVerification : candidate.reason;
    if (here) {
      track.again = before.frames_since_lost < tracker::kRecentFrames;
      PrintVerifier::Verification verification;
      track.verified = verifies_finds();
      if (track.verified) measure(i, detection);
      if (track.verified)
        verification = print_verifier->verify_found(i, frame_tracker.frame(), track, track.again);
      track.shown_reason = verification.reason;
      if (resolve_overlap(i, detection, result)) {
        if (!track.verified) verification.reason = before.last_reason;
        show(i, verification, detection, result);
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

/// Learns the surroundings from a frame that shows the anchor pattern, or else derives its pose
/// from them. What the pattern itself says wins wherever it is shown: following the surroundings
/// from half-covered patterns on made 0.66 px of three rendered videos into 3.5 (`modar-lab bench
/// extended --only partly`, 95th percentile). But little of a pattern is nothing to learn from, so
/// they are followed meanwhile.
void PoseLoop::State::extend(TrackResult& result) {
  Detection* shown = choose_anchor(result);
  Track& track = tracks[anchor];
  const bool was = extending;
  const bool doubtful = shown != nullptr && (track.has_motion || was) && doubts(*shown);
  Detection followed;
  extending = (shown == nullptr || doubtful || was) && !track.homography_only &&
              follow_surroundings(shown == nullptr, followed);
  if (shown == nullptr || doubtful) last_offset.reset();
  constexpr double kForgotten = 0.98;  // of the usual patches, a frame: half in a second
  usual_patches *= kForgotten;
  if (shown != nullptr) {
    if (extending && guessed) start_blend(followed.pose, shown->pose);
    if (!doubtful && (!extending || seen_twice(*shown, followed))) {
      usual_patches = std::max(usual_patches, 1.0 * shown->inliers);
      if (extending) surroundings->correct(followed.pose, shown->pose);
      extending = false;
      surroundings->learn(frame_tracker.frame(), shown->pose, shown->corners, shown->inliers,
                          turn_seen());
    }
    guessed = false;
    continue_blend(*shown);
    return;
  }
  guessed = extending && !(track.tracked && track.shown_reason == Reason::kOtherPrint);
  if (!extending) {
    blend = {};
    return;
  }
  const Pose known = followed.pose;
  continue_blend(followed);
  if (!guessed) return;
  if (!track.tracked && ++frames_unseen % kLookEvery == 0) find_again(known);
  result.visible.push_back(followed);
}

/// The detection of the anchor pattern in this frame, or null if it is not shown. Chooses another
/// anchor if no surroundings would be lost.
Detection* PoseLoop::State::choose_anchor(TrackResult& result) {
  Detection* largest = nullptr;
  double most = 0;
  for (Detection& one : result.visible) {
    if (patterns[anchor].index == one.pattern) return &one;
    const glm::dvec2 a = one.corners[2] - one.corners[0];
    const glm::dvec2 b = one.corners[3] - one.corners[1];
    const double area = std::abs(a.x * b.y - a.y * b.x);
    if (area <= most) continue;
    most = area;
    largest = &one;
  }
  if (largest == nullptr || extending || surroundings->ready()) return nullptr;
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (patterns[i].index == largest->pattern) anchor = i;
  }
  surroundings->clear();
  usual_patches = 0;
  return largest;
}

/// Whether so little of the anchor pattern fits, or is in view, that its surroundings had better
/// not be learned from its pose.
bool PoseLoop::State::doubts(const Detection& seen) const {
  // Shares of the patches in view that fit, and of those that fitted a moment ago: what covers a
  // pattern, or the little that the frame's edge leaves of it, gives poses that are off by degrees,
  // where steady surroundings are off by tenths. Of few patches, which a small pattern has as well,
  // most of the surroundings have to contradict. Set by hand on `modar-lab bench extended`.
  constexpr double kFew = 0.5;
  constexpr double kFewer = 0.8;
  constexpr double kOfUsual = 0.5;
  constexpr int kFewPatches = 80;
  constexpr double kContradicted = 0.6;
  const double share = 1.0 * seen.inliers / std::max(seen.matches, 1);
  if (share < kFew) return true;
  if ((share < kFewer || seen.inliers < kOfUsual * usual_patches) && surroundings->ready())
    return true;
  if (share >= kFewer && seen.inliers >= kFewPatches) return false;
  return surroundings->agreement(frame_tracker.frame(), seen.pose) < kContradicted;
}

/// The pose of the anchor pattern from its surroundings. shown: the frame shows that pose.
bool PoseLoop::State::follow_surroundings(bool shown, Detection& detection) {
  if (!extending && !surroundings->ready()) return false;
  tracker::ExtendedPose extended;
  if (!surroundings->follow(frame_tracker.frame(), turn_seen(), extended)) {
    return false;
  }
  detection.pattern = patterns[anchor].index;
  detection.pose = extended.pose;
  detection.extended = true;
  detection.position_sigma = extended.position_sigma;
  detection.rotation_sigma = extended.rotation_sigma;
  if (!corners_of(extended.pose, detection.corners)) return false;
  if (shown) smooth_correction(extended, detection.corners);
  return true;
}

/// Points that come into view again may correct the pose abruptly: spreads the correction over
/// several frames.
void PoseLoop::State::smooth_correction(const tracker::ExtendedPose& extended,
                                        const std::array<glm::dvec2, 4>& corners) {
  constexpr double kCorrected = 4.0;  // pixels from the corners that motion predicts; not measured
  const auto in_frame = [&](glm::dvec2 p) {
    return p.x >= 0 && p.y >= 0 && p.x < camera.width && p.y < camera.height;
  };
  if (std::none_of(corners.begin(), corners.end(), in_frame))
    return;  // far out, pixels mean little
  const Pose* nearest = nullptr;
  double least = 0;
  for (const Pose& expected : extended.expected) {
    std::array<glm::dvec2, 4> there;
    if (!corners_of(expected, there)) continue;
    const double way = way_of(there, corners);
    if (nearest == nullptr || way < least) {
      nearest = &expected;
      least = way;
    }
  }
  if (nearest != nullptr && least > kCorrected) start_blend(*nearest, extended.pose);
}

bool PoseLoop::State::corners_of(const Pose& pose, std::array<glm::dvec2, 4>& corners) const {
  return tracker::map_corners(patterns[anchor],
                              tracker::map_of_pose(patterns[anchor], camera, pose), corners);
}

/// Whether two consecutive frames measure the same offset of the anchor pattern from the pose of
/// the surroundings: the first features of a pattern that comes back can give any pose.
bool PoseLoop::State::seen_twice(const Detection& seen, const Detection& followed) {
  constexpr double kSame = 0.02;  // of the outline's diagonal. By hand
  std::array<glm::dvec2, 4> now;
  for (std::size_t i = 0; i < 4; ++i) now[i] = seen.corners[i] - followed.corners[i];
  const double diagonal = std::max(glm::length(followed.corners[2] - followed.corners[0]),
                                   glm::length(followed.corners[3] - followed.corners[1]));
  const bool twice = last_offset.has_value() && way_of(now, *last_offset) < kSame * diagonal;
  last_offset = now;
  return twice;
}

/// Tries to find the anchor pattern where its surroundings place it, and tracks it.
void PoseLoop::State::find_again(const Pose& followed) {
  const TrackedPattern& pattern = patterns[anchor];
  const tracker::PlaneMap map = tracker::map_of_pose(pattern, camera, followed);
  if (!tracker::in_view(pattern, map, camera)) return;
  Track next;
  next.pose = followed;
  PatchFit fit;
  Detection detection;
  if (!tracker::refine(pattern, frame_tracker.frame(), tracker::SearchRadius::kFrame, next.pose,
                       fit) ||
      tracker::photometric_percent(pattern, frame_tracker.frame(), next.pose) <
          tracker::kMinPercent ||
      !frame_tracker.locate(pattern, next, detection)) {
    return;
  }
  next.tracked = true;
  next.again = true;
  tracks[anchor] = next;
}

/// `pose` with the part of the correction that is not yet applied.
Pose PoseLoop::State::blended(const Pose& pose) const {
  return {rotation_matrix(blend.share * blend.rotation) * pose.rotation,
          pose.translation + blend.share * blend.translation};
}

/// Starts a correction of the shown pose from `from` to `to`.
void PoseLoop::State::start_blend(const Pose& from, const Pose& to) {
  // Shortest and longest correction, in frames, and the pixels by which it moves the corners per
  // frame: a slower one shows the wrong pose for longer. Not measured.
  constexpr double kFrames = 10;
  constexpr double kMostFrames = 40;
  constexpr double kStep = 3.0;
  const Pose shown = blended(from);
  std::array<glm::dvec2, 4> shown_corners;
  std::array<glm::dvec2, 4> corners;
  const bool known = corners_of(shown, shown_corners) && corners_of(to, corners);
  const double way = known ? way_of(shown_corners, corners) : 0;
  blend.rotation = rotation_vector(shown.rotation * glm::transpose(to.rotation));
  blend.translation = shown.translation - to.translation;
  blend.share = 1;
  blend.step = 1 / std::clamp(way / kStep, kFrames, kMostFrames);
}

void PoseLoop::State::continue_blend(Detection& detection) {
  if (blend.share <= 0) return;
  Track shown;
  shown.pose = blended(detection.pose);
  if (frame_tracker.locate(patterns[anchor], shown, detection)) {
    detection.extended = true;
    detection.position_sigma += blend.share * glm::length(blend.translation);
    detection.rotation_sigma += blend.share * glm::length(blend.rotation);
  }
  blend.share -= blend.step;
}

}  // namespace modar
