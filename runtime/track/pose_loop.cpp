// The states of the loop: search for patterns, track those found, give the reason if a pattern is
// lost.
#include "modar/pose_loop.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "extended_tracking.hpp"
#include "frame_tracker.hpp"
#include "print_verifier.hpp"
#include "runtime/platform/lap_clock.hpp"
#include "search_scheduler.hpp"
#include "self_calibration.hpp"

namespace modar {
namespace {

using tracker::DetectionCandidate;
using tracker::PatchFit;
using tracker::PrintVerifier;
using tracker::Track;
using tracker::TrackedPattern;

// Pixels of the prediction's error from which a pose is tested for a slip. Lower takes time and
// rejects blurred finds, higher shows wrong poses.
constexpr double kSlippingError = 2.5;
// Patches that must fit for a pose to need no such test.
constexpr int kSurePatches = 30;
// Percent of the patches in view that must fit for that.
constexpr int kSurePercent = 95;
// Frames after a loss in which a pattern found again is tested for a slip.
constexpr int kRefoundFrames = 10;
// Frames in a row whose patches contradict each other (PatchFit::inconsistent()) until a pattern is
// searched for anew; a wrong pose is shown no longer.
constexpr int kMaxInconsistent = 2;
// Frames without a find per look at the whole frame for the reason. Lower takes time.
constexpr unsigned kEvidenceFrames = 4;

}  // namespace

std::uint32_t copies_of(const BundleView& bundle, std::uint32_t pattern, int max_instances) {
  std::uint32_t copies = max_instances > 0 ? static_cast<std::uint32_t>(max_instances) : 1;
  if (max_instances <= 0 && pattern < bundle.patterns().size())
    copies = bundle.patterns()[pattern].copies;
  return std::clamp(copies, 1u, kMaxCopies);
}

std::uint32_t most_copies(const BundleView& bundle, int max_instances) {
  std::uint32_t most = copies_of(bundle, kNone, max_instances);
  for (std::uint32_t i = 0; i < bundle.patterns().size(); ++i)
    most = std::max(most, copies_of(bundle, i, max_instances));
  return most;
}

struct PoseLoop::State {
  State(const Camera& seen_by, const PoseLoopOptions& how)
      : camera(seen_by), options(how), frame_tracker(camera, how.detect) {}

  Camera camera;
  PoseLoopOptions options;
  std::vector<tracker::PatternPyramid> pyramids;  ///< of the patterns, by index
  std::vector<TrackedPattern> patterns;           ///< the prints, then their further copies
  std::vector<Track> tracks;                      ///< one per pattern
  std::vector<tracker::KnownCopy> known;
  tracker::FrameTracker frame_tracker;
  std::unique_ptr<tracker::SearchScheduler> search;
  std::unique_ptr<PrintVerifier> print_verifier;
  std::unique_ptr<tracker::SelfCalibration> calibration;  ///< if the camera is a guess
  std::unique_ptr<tracker::ExtendedTracking> extended;    ///< if it was requested
  tracker::ReasonEvidence evidence;
  unsigned frames_unseen = 0;      ///< in a row
  std::optional<glm::dvec3> turn;  ///< of what the camera sees, since the last frame

  void step(const GrayImage& frame, TrackResult& result);
  void calibrate();
  void track_all(TrackResult& result);
  void accept(TrackResult& result);
  void accept(std::size_t print, const DetectionCandidate& candidate, TrackResult& result);
  void add_copies();
  void list_known();
  [[nodiscard]] std::size_t place_for(std::size_t print, const Pose* pose) const;
  bool drop_double(std::size_t i, const Detection& detection, TrackResult& result);
  void explain(TrackResult& result);
  bool start_track(const TrackedPattern& pattern, Track& track, const DetectionCandidate& candidate,
                   Detection& detection) const;
  bool measure(std::size_t i, Detection& detection);
  [[nodiscard]] bool has_slipped(std::size_t i, const Track& track) const;
  bool resolve_overlap(std::size_t i, const Detection& detection, TrackResult& result);
  bool show(std::size_t i, const PrintVerifier::Verification& verification, Detection& detection,
            TrackResult& result);
  bool switch_pattern(std::size_t from, std::size_t to, Detection& detection);
};

[[gnu::cold]] PoseLoop::PoseLoop(std::unique_ptr<State> state) : state_(std::move(state)) {}
PoseLoop::~PoseLoop() = default;

[[gnu::cold]] Result<std::unique_ptr<PoseLoop>> PoseLoop::create(const BundleView& bundle,
                                                                 const Camera& camera,
                                                                 const PoseLoopOptions& options,
                                                                 std::span<const OwnRecord> own) {
  if (camera.width < 1 || camera.height < 1 || camera.width > 16384 || camera.height > 16384) {
    return fail(ExitCode::kInvalidInput, "tracker.frame-size", "", "the camera has no frame size",
                "give a camera of 1 to 16384 pixels a side");
  }
  auto state = std::make_unique<State>(camera, options);
  const std::uint32_t count = bundle.patterns().size();
  const auto all = static_cast<std::uint32_t>(count + own.size());
  state->pyramids = std::vector<tracker::PatternPyramid>(all);
  for (std::uint32_t i = 0; i < all; ++i) {
    const auto bytes = i < count ? bundle.section(SectionType::kTrackerRecord, i) : own[i - count];
    if (bytes.empty() && i < count) continue;
    const auto shape = i < count ? bundle.section(SectionType::kPatternShape, i) : OwnRecord{};
    MODAR_ASSIGN(const TrackedPattern pattern,
                 tracker::view_tracked_pattern(bytes, i, state->pyramids[i], shape));
    state->patterns.push_back(pattern);
  }
  if (state->patterns.empty()) {
    return fail(ExitCode::kInvalidInput, "tracker.no-patterns", "",
                "the bundle holds no pattern with a record for this loop",
                "bake it with a pattern");
  }
  for (TrackedPattern& print : state->patterns) {
    print.copies = copies_of(bundle, print.index, options.max_instances);
    if (state->patterns.size() < tracker::kMany) print.fine_cells = fine_cells(print);
  }
  state->add_copies();
  state->tracks.resize(state->patterns.size());
  state->known.reserve(state->patterns.size());
  state->search = std::make_unique<tracker::SearchScheduler>(camera, state->patterns, options);
  state->print_verifier =
      std::make_unique<PrintVerifier>(state->patterns, !options.estimate_camera);
  if (options.extended) {
    state->extended = std::make_unique<tracker::ExtendedTracking>(
        state->camera, state->patterns, state->tracks, state->frame_tracker);
  }
  if (options.estimate_camera) {
    state->calibration = std::make_unique<tracker::SelfCalibration>(
        state->camera, state->patterns, state->tracks, state->frame_tracker);
  }
  return std::unique_ptr<PoseLoop>(new PoseLoop(std::move(state)));
}

void PoseLoop::set_turn(const glm::dvec3& rotation) {
  state_->turn = -rotation;
}

void PoseLoop::reset() {
  for (Track& track : state_->tracks) track = {};
  state_->search->reset();
  if (state_->extended != nullptr) state_->extended->reset();
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

void PoseLoop::State::step(const GrayImage& frame, TrackResult& result) {
  result.visible.clear();
  result.visible.reserve(tracks.size());
  result.reason = Reason::kNoFeatures;
  result.features = 0;
  result.crowded = -1;
  result.times = {};
  LapClock clock;
  if (calibration != nullptr) calibrate();
  result.camera = calibration != nullptr ? calibration->estimate() : CameraEstimate{camera.fx};
  result.camera.focal = camera.fx;
  frame_tracker.set_frame(frame);
  track_all(result);
  if (search->take()) accept(result);
  const bool following = extended != nullptr && extended->following();
  const auto tracked =
      std::count_if(tracks.begin(), tracks.end(), [](const Track& track) { return track.tracked; });
  if (search->advance(tracked + (following ? 1 : 0))) accept(result);
  result.times.pose = clock.lap();
  if (search->due(patterns, tracks, following)) {
    list_known();
    if (search->start(frame, frame_tracker.extractor(), known)) accept(result);
  }
  if (extended != nullptr) extended->step(result, turn.has_value() ? &*turn : nullptr);
  if (calibration != nullptr) calibration->place_pictures(result);
  turn.reset();
  explain(result);
  std::sort(result.visible.begin(), result.visible.end(),
            [](const Detection& a, const Detection& b) {
              return a.pattern != b.pattern ? a.pattern < b.pattern : a.copy < b.copy;
            });
}

/// Further copies follow the prints, which keep their numbers.
[[gnu::cold]] void PoseLoop::State::add_copies() {
  const std::size_t prints = patterns.size();
  for (std::size_t i = 0; i < prints; ++i) patterns[i].first = static_cast<std::uint32_t>(i);
  for (std::uint32_t copy = 1; copy < kMaxCopies; ++copy) {
    for (std::size_t i = 0; i < prints; ++i) {
      if (copy >= patterns[i].copies) continue;
      TrackedPattern another = patterns[i];
      another.copy = copy;
      patterns.push_back(another);
    }
  }
}

/// Where the copies are that a search need not find.
void PoseLoop::State::list_known() {
  known.clear();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (patterns[i].copies == 1 || !tracks[i].tracked) continue;
    tracker::KnownCopy& copy = known.emplace_back();
    copy.pattern = patterns[i].first;
    copy.map = tracks[i].homography_only
                   ? tracks[i].map
                   : tracker::map_of_pose(patterns[i], camera, tracks[i].pose);
    copy.map.lens = nullptr;
  }
}

/// The copy of a print that is not tracked and was seen last most like this, so that it keeps its
/// number; patterns.size() if all are tracked. Without a pose: the first of them.
std::size_t PoseLoop::State::place_for(std::size_t print, const Pose* pose) const {
  // Share of the frame's width by which a copy may have moved to count as one that was lost.
  constexpr double kNear = 0.25;
  std::size_t best = patterns.size();
  double least = std::numeric_limits<double>::infinity();
  Track asked;
  Detection there;
  if (pose != nullptr) asked.pose = *pose;
  const bool located = pose != nullptr && frame_tracker.locate(patterns[print], asked, there);
  for (std::size_t i = print; i < patterns.size(); ++i) {
    if (patterns[i].first != print || tracks[i].tracked) continue;
    if (!located || patterns[i].copies == 1) return i;
    Detection before;
    const bool seen = tracks[i].pose.translation != Pose{}.translation &&
                      frame_tracker.locate(patterns[i], tracks[i], before);
    const double way =
        seen ? tracker::corner_distance(there.corners, before.corners) : kNear * camera.width;
    if (way >= least) continue;
    least = way;
    best = i;
  }
  return best;
}

/// A copy that another one covers is soon drawn to it: drops the one of the two that jumped. False
/// if it is this one.
bool PoseLoop::State::drop_double(std::size_t i, const Detection& detection, TrackResult& result) {
  // Share of the diagonal within which two outlines are the same. Higher drops copies that overlap.
  constexpr double kSame = 0.1;
  const double limit = kSame * glm::length(detection.corners[2] - detection.corners[0]);
  for (std::size_t k = patterns[i].first; k < i; ++k) {
    Detection other;
    if (patterns[k].first != patterns[i].first || !tracks[k].tracked ||
        !frame_tracker.locate(patterns[k], tracks[k], other) ||
        tracker::corner_distance(other.corners, detection.corners) > limit) {
      continue;
    }
    const bool this_one = tracks[i].prediction_error >= tracks[k].prediction_error;
    Track& doubled = tracks[this_one ? i : k];
    doubled.tracked = doubled.has_motion = false;
    doubled.pose = doubled.previous;
    doubled.frames_since_lost = 0;
    doubled.last_reason = Reason::kLostByBlur;
    if (this_one) return false;
    std::erase_if(result.visible,
                  [&](const Detection& s) { return patterns[k].shown_by(s.pattern, s.copy); });
  }
  return true;
}

/// The reason of the pattern that came closest, as what it and the frame look like explains it. Of
/// those that came equally close, the one with most evidence of its place.
void PoseLoop::State::explain(TrackResult& result) {
  std::size_t closest = 0;
  int votes = 0;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Track& track = tracks[i];
    const Reason reason = track.tracked ? track.shown_reason : track.last_reason;
    const int further = progress(reason) - progress(result.reason);
    if (further < 0 || (further == 0 && track.place.votes <= votes)) continue;
    closest = i;
    votes = track.place.votes;
    result.reason = reason;
  }
  const auto pyramid = frame_tracker.frame().pyramid;
  if (!result.visible.empty() || pyramid.size() < tracker::kEvidenceLevels) {
    frames_unseen = 0;
    return;
  }
  tracker::LikelyPlace place = tracks[closest].place;
  Detection hidden;
  if (tracks[closest].tracked && frame_tracker.locate(patterns[closest], tracks[closest], hidden)) {
    place = tracker::seen_at(hidden.corners);
  }
  if (frames_unseen++ % kEvidenceFrames == 0) tracker::look_at_frame(pyramid, evidence);
  tracker::look_at_place(pyramid, place, evidence);
  result.reason = tracker::reason_of(result.reason, evidence);
}

/// Continues with the camera estimated from the frames so far.
void PoseLoop::State::calibrate() {
  const bool moved = calibration->apply();
  search->set_shapes(camera, [this](std::size_t i) { return calibration->aspect(i); });
  if (moved && extended != nullptr) extended->forget_surroundings();
}

void PoseLoop::State::track_all(TrackResult& result) {
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    Track& track = tracks[i];
    Detection detection;
    if (!track.tracked) {
      track.frames_since_lost = std::min(track.frames_since_lost + 1, tracker::kRecentFrames);
      track.place.move();
      continue;
    }
    track.tracked = options.track && frame_tracker.update(patterns[i], track, detection);
    const bool sure = detection.inliers >= kSurePatches &&
                      detection.inliers * 100 >= detection.matches * kSurePercent;
    if (track.tracked && !sure && track.prediction_error >= kSlippingError &&
        has_slipped(i, track)) {
      track.tracked = track.has_motion = false;
      track.last_reason = Reason::kLostByBlur;
      track.place = tracker::seen_at(detection.corners);
    }
    const bool inconsistent = calibration == nullptr && track.inconsistent > kMaxInconsistent;
    if (track.tracked && (inconsistent || !measure(i, detection))) {
      track.tracked = track.has_motion = false;
      track.last_reason = Reason::kFailedVerification;
      track.place = tracker::seen_at(detection.corners);
    }
    if (track.tracked && patterns[i].copies > 1 && !drop_double(i, detection, result)) continue;
    if (track.tracked && track.doubts > 0) {
      track.shown_reason = Reason::kLostByBlur;
    } else if (track.tracked) {
      const auto frame = frame_tracker.frame();
      show(i,
           track.verified ? print_verifier->verify_tracked(i, frame, track)
                          : print_verifier->verify_found(i, frame, track),
           detection, result);
      track.verified = true;
    } else {
      track.frames_since_lost = options.track ? 0 : tracker::kRecentFrames;
    }
  }
}

bool PoseLoop::State::measure(std::size_t i, Detection& detection) {
  return calibration == nullptr || calibration->measure(i, detection);
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
  to = place_for(to, &tracks[from].pose);
  if (to == patterns.size() || tracks[from].homography_only) return false;
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
      print_verifier->verify_found(to, frame_tracker.frame(), next);
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
  if (candidate.inconsistent) return false;
  Track next;
  next.pose = candidate.pose;
  next.homography_only = candidate.homography_only;
  next.map = candidate.map;
  detection.matches = candidate.matches;
  detection.inliers = candidate.inliers;
  if (search->late()) {
    // It was found in an earlier frame.
    PatchFit fit;
    const bool here =
        next.homography_only
            ? tracker::refine_map(pattern, frame_tracker.frame(), next.map, fit)
            : tracker::refine(pattern, frame_tracker.frame(), tracker::SearchRadius::kFar,
                              next.pose, fit, search->verifies_finds()) &&
                  tracker::photometric_percent(pattern, frame_tracker.frame(), next.pose) >=
                      (fit.close >= tracker::kClosePatches ? tracker::kClosePatchesPercent
                                                           : tracker::kMinPercent);
    if (!here || (calibration == nullptr && fit.inconsistent())) return false;
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
        if (patterns[i].first == patterns[k].first) return false;
        if (percent_of(i) <= percent_of(k)) return false;
        continue;
      }
      tracks[k] = {};
      tracks[k].last_reason = Reason::kFailedVerification;
      std::erase_if(result.visible,
                    [&](const Detection& s) { return patterns[k].shown_by(s.pattern, s.copy); });
    }
  }
  return true;
}

/// Starts tracks from the candidates of a search, and adds them to the frame's result.
void PoseLoop::State::accept(TrackResult& result) {
  const tracker::DetectionCandidates& candidates = search->candidates();
  result.features = candidates.features;
  result.times.detect = candidates.times.detect;
  result.times.match = candidates.times.match;
  result.times.homography = candidates.times.homography;
  result.crowded = candidates.crowded;
  for (const auto& [print, candidate] : candidates.copies) accept(print, candidate, result);
  for (std::size_t i = 0; i < candidates.patterns.size(); ++i) {
    if (search->searched(i)) accept(i, candidates.patterns[i], result);
  }
}

/// The same of one candidate.
void PoseLoop::State::accept(std::size_t print, const DetectionCandidate& candidate,
                             TrackResult& result) {
  const std::size_t i =
      place_for(print, candidate.reason == Reason::kVisible ? &candidate.pose : nullptr);
  if (i == patterns.size()) return;
  Track& track = tracks[i];
  const bool kept = track.place.votes == tracker::LikelyPlace::kSeen &&
                    track.place.frames < tracker::kRecentFrames;
  if (!kept || candidate.place.votes == tracker::LikelyPlace::kSeen) track.place = candidate.place;
  const Track before = track;
  Detection detection;
  if (calibration != nullptr) calibration->forget_plane(i);
  bool here =
      candidate.reason == Reason::kVisible && start_track(patterns[i], track, candidate, detection);
  if (here) {
    track.verified = search->verifies_finds();
    if (before.frames_since_lost == 0) track.place = before.place;
    const bool slipped = before.verified && before.frames_since_lost < kRefoundFrames &&
                         print_verifier->has_slipped(i, frame_tracker.frame(), track);
    here = !slipped && (!track.verified || measure(i, detection));
    if (!here) track = before;
  }
  Reason reason =
      candidate.reason == Reason::kVisible ? Reason::kFailedVerification : candidate.reason;
  if (here) {
    PrintVerifier::Verification verification;
    if (track.verified)
      verification = print_verifier->verify_found(i, frame_tracker.frame(), track);
    track.shown_reason = verification.reason;
    if (resolve_overlap(i, detection, result)) {
      if (!track.verified) verification.reason = before.last_reason;
      show(i, verification, detection, result);
      search->found();
      return;
    }
    reason = Reason::kOtherPrint;
    track = before;  // a recently lost one keeps its priority
  }
  // In the frame that lost it, the reason of the loss says more.
  if (track.frames_since_lost > 0 || progress(reason) > progress(track.last_reason))
    track.last_reason = reason;
}

}  // namespace modar
