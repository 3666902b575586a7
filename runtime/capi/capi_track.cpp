// modar.h: our pose loop, the two-frame rule, and poses as GL's matrices.
#include <algorithm>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "modar/pose_loop.hpp"
#include "modar/pose_smoother.hpp"
#include "runtime/capi/handles.hpp"

static_assert(MODAR_REASON_VISIBLE == static_cast<int>(modar::Reason::kVisible));
static_assert(MODAR_REASON_NO_FEATURES == static_cast<int>(modar::Reason::kNoFeatures));
static_assert(MODAR_REASON_FEW_MATCHES == static_cast<int>(modar::Reason::kFewMatches));
static_assert(MODAR_REASON_NOT_IN_VIEW == static_cast<int>(modar::Reason::kNoGeometry));
static_assert(MODAR_REASON_FAILED_VERIFICATION ==
              static_cast<int>(modar::Reason::kFailedVerification));
static_assert(MODAR_REASON_LOST_BY_BLUR == static_cast<int>(modar::Reason::kLostByBlur));
static_assert(MODAR_REASON_OUT_OF_VIEW == static_cast<int>(modar::Reason::kOutOfView));
static_assert(MODAR_REASON_ANOTHER_PRINT == static_cast<int>(modar::Reason::kOtherPrint));
static_assert(MODAR_REASON_CURVED == static_cast<int>(modar::Reason::kCurved));
static_assert(MODAR_REASON_TOO_SMALL == static_cast<int>(modar::Reason::kTooSmall));
static_assert(MODAR_REASON_TOO_DARK == static_cast<int>(modar::Reason::kTooDark));
static_assert(MODAR_REASON_BLURRED == static_cast<int>(modar::Reason::kBlurred));
static_assert(MODAR_REASON_OVEREXPOSED == static_cast<int>(modar::Reason::kOverexposed));
static_assert(MODAR_REASON_GLARE == static_cast<int>(modar::Reason::kGlare));
static_assert(MODAR_REASON_AT_THE_EDGE == static_cast<int>(modar::Reason::kAtTheEdge));

struct modar_tracker {
  const modar_bundle* bundle;
  modar::PoseLoopOptions options;
  modar::Camera camera;
  std::vector<std::vector<std::uint64_t>> own;  ///< records of added pictures
  std::unique_ptr<modar::PoseLoop> loop;
  modar::Hysteresis hysteresis;
  modar::PoseSmoother smoother;
  double smooth_ms = 0;
  double time_s = 0;
  modar::TrackResult result;
  std::size_t patterns = 0;
  std::size_t copies = 1;         ///< most of a pattern
  std::vector<modar_pose> poses;  ///< one a pattern, then those of their second copies, and so on
};

namespace {

/// Beyond it, rows would overflow what counts them.
constexpr std::size_t kMostStride = std::size_t{1} << 24;

void set_pose(const modar::Pose& from, const glm::dmat4x3& stretch, modar_pose& to) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      to.rotation[3 * row + column] = static_cast<float>(from.rotation[column][row]);
    }
    to.translation[row] = static_cast<float>(from.translation[row]);
    for (int column = 0; column < 4; ++column) {
      to.stretch[4 * row + column] = static_cast<float>(stretch[column][row]);
    }
  }
}

}  // namespace

uint32_t modar_pattern_copies(const modar_bundle* bundle, uint32_t index) {
  return bundle == nullptr ? 1 : modar::copies_of(bundle->view, index, 0);
}

modar_tracker* modar_tracker_create(const modar_bundle* bundle, const modar_camera* camera,
                                    const modar_tracker_options* options, modar_error* error) {
  if (bundle == nullptr || camera == nullptr) {
    return modar::fail_null(modar::missing(bundle == nullptr ? "bundle" : "camera"), error);
  }
  const modar::Camera ours = modar::camera_of(*camera);
  if (const auto valid = modar::validate(ours); !valid)
    return modar::fail_null(valid.error(), error);
  const modar_tracker_options asked =
      options == nullptr ? modar_tracker_options{} : modar::grown(*options);
  if (!modar::usable(*camera)) return modar::fail_null(modar::bad_number("camera"), error);
  if (!modar::usable(asked.smooth_ms)) {
    return modar::fail_null(modar::bad_number("smooth_ms"), error);
  }
  modar::PoseLoopOptions how;
  how.async_search = asked.async_search != 0;
  if (asked.search_every > 0) how.search_every = asked.search_every;
  how.budget = asked.budget;
  how.extended = asked.extended != 0;
  how.estimate_camera = asked.estimate_camera != 0;
  how.max_instances = std::max(asked.max_instances, 0);
  auto loop = modar::PoseLoop::create(bundle->view, ours, how);
  if (!loop) return modar::fail_null(loop.error(), error);
  const std::size_t patterns = bundle->view.patterns().size();
  const double smooth_ms = std::clamp(asked.smooth_ms, 0.0, 1000.0);
  const std::size_t copies = modar::most_copies(bundle->view, how.max_instances);
  return new modar_tracker{bundle,
                           how,
                           ours,
                           {},
                           std::move(*loop),
                           modar::Hysteresis(patterns, true, false, copies),
                           modar::PoseSmoother(patterns, smooth_ms, copies),
                           smooth_ms,
                           0,
                           {},
                           patterns,
                           copies,
                           std::vector<modar_pose>(patterns * copies)};
}

void modar_tracker_reset(modar_tracker* tracker) {
  if (tracker == nullptr) return;
  tracker->loop->reset();
  tracker->hysteresis = modar::Hysteresis(tracker->patterns, true, false, tracker->copies);
  tracker->smoother = modar::PoseSmoother(tracker->patterns, tracker->smooth_ms, tracker->copies);
  tracker->poses.assign(tracker->patterns * tracker->copies, modar_pose{});
}

int modar_tracker_add_pattern(modar_tracker* tracker, const modar_record* record, uint32_t* pattern,
                              modar_error* error) {
  if (tracker == nullptr || record == nullptr) {
    return modar::set_error(modar::missing(tracker == nullptr ? "tracker" : "record"), error);
  }
  auto own = tracker->own;
  own.push_back(record->words);
  std::vector<modar::OwnRecord> views;
  for (const auto& words : own) views.push_back(std::as_bytes(std::span(words)));
  // The lens estimate stays.
  modar::Camera camera = tracker->camera;
  const modar::CameraEstimate& now = tracker->result.camera;
  if (now.estimated) camera.fx = camera.fy = now.focal;
  auto loop = modar::PoseLoop::create(tracker->bundle->view, camera, tracker->options, views);
  if (!loop) return modar::set_error(loop.error(), error);
  tracker->camera = camera;
  tracker->loop = std::move(*loop);
  tracker->own = std::move(own);
  if (pattern != nullptr) *pattern = static_cast<std::uint32_t>(tracker->patterns);
  ++tracker->patterns;
  modar_tracker_reset(tracker);
  return MODAR_OK;
}

void modar_tracker_destroy(modar_tracker* tracker) {
  delete tracker;
}

int modar_tracker_step(modar_tracker* tracker, const uint8_t* gray, size_t stride, double time_s,
                       modar_error* error) {
  if (tracker == nullptr || gray == nullptr) {
    return modar::set_error(modar::missing(tracker == nullptr ? "tracker" : "gray"), error);
  }
  const modar::Camera& camera = tracker->camera;
  if (stride < static_cast<std::size_t>(camera.width) || stride > kMostStride) {
    return modar::set_error(
        {modar::ExitCode::kUsage, "capi.stride", "stride",
         std::to_string(stride) + " bytes a row, where the camera's frames are " +
             std::to_string(camera.width) + " pixels wide",
         "pass the bytes from one row of the gray plane to the next"},
        error);
  }
  if (!modar::usable(time_s)) return modar::set_error(modar::bad_number("time_s"), error);
  if (time_s < 0) time_s = tracker->time_s + 1.0 / 30.0;
  if (const auto same = tracker->bundle->file.intact(); !same) return modar::set_error(same, error);
  const auto done = tracker->loop->step(
      {gray, camera.width, camera.height, static_cast<std::ptrdiff_t>(stride)}, tracker->result);
  if (!done) return modar::set_error(done, error);
  tracker->time_s = time_s;
  tracker->smoother.step(time_s, tracker->result.visible);
  const auto states = tracker->hysteresis.step(tracker->result.visible);
  for (std::size_t i = 0; i < states.size(); ++i) {
    modar_pose& pose = tracker->poses[i];
    pose.shown = states[i].shown ? 1 : 0;
    pose.visible = 0;
    pose.inliers = 0;
    pose.fit = 0;
    pose.agreeing = 0;
    pose.likeness = 0;
    pose.extended = 0;
    pose.position_sigma = 0;
    pose.rotation_sigma = 0;
    if (states[i].shown) set_pose(states[i].pose, states[i].stretch, pose);
  }
  for (const modar::Detection& seen : tracker->result.visible) {
    modar_pose& pose = tracker->poses[seen.copy * tracker->patterns + seen.pattern];
    set_pose(seen.pose, seen.stretch, pose);
    pose.visible = 1;
    pose.inliers = seen.inliers;
    pose.fit =
        seen.matches > 0
            ? std::min(1.0f, static_cast<float>(seen.inliers) / static_cast<float>(seen.matches))
            : 0;
    pose.agreeing = static_cast<float>(seen.agreeing);
    pose.likeness = static_cast<float>(seen.likeness);
    pose.extended = seen.extended ? 1 : 0;
    pose.position_sigma = static_cast<float>(seen.position_sigma);
    pose.rotation_sigma = static_cast<float>(seen.rotation_sigma);
    for (std::size_t i = 0; i < seen.corners.size(); ++i) {
      pose.corners[2 * i] = static_cast<float>(seen.corners[i].x);
      pose.corners[2 * i + 1] = static_cast<float>(seen.corners[i].y);
    }
  }
  return 0;
}

void modar_tracker_turn(modar_tracker* tracker, const double rotation[3]) {
  if (tracker == nullptr || rotation == nullptr || !modar::usable(rotation, 3)) return;
  tracker->loop->set_turn({rotation[0], rotation[1], rotation[2]});
}

int modar_tracker_pose(const modar_tracker* tracker, uint32_t pattern, modar_pose* pose) {
  return modar_tracker_copy(tracker, pattern, 0, pose);
}

int modar_tracker_copy(const modar_tracker* tracker, uint32_t pattern, uint32_t copy,
                       modar_pose* pose) {
  if (tracker == nullptr || pattern >= tracker->patterns || copy >= tracker->copies) return 0;
  const modar_pose& known = tracker->poses[copy * tracker->patterns + pattern];
  modar::give(known, pose);
  return known.visible;
}

int modar_tracker_crowded(const modar_tracker* tracker) {
  return tracker == nullptr ? -1 : tracker->result.crowded;
}

double modar_tracker_camera(const modar_tracker* tracker, modar_camera* camera) {
  if (tracker == nullptr) return 0.0;
  modar::Camera ours = tracker->camera;
  const modar::CameraEstimate& now = tracker->result.camera;
  if (now.estimated) ours.fx = ours.fy = now.focal;
  modar::give_camera(ours, camera);
  return now.estimated ? now.sigma : 0.0;
}

int modar_tracker_reason(const modar_tracker* tracker) {
  return tracker == nullptr ? -1 : static_cast<int>(tracker->result.reason);
}

const char* modar_reason_text(int reason) {
  const bool known = reason >= 0 && reason <= MODAR_REASON_AT_THE_EDGE;
  return known ? modar::to_string(static_cast<modar::Reason>(reason)) : "unknown";
}

void modar_view(const modar_pose* theirs, float view[16]) {
  if (theirs == nullptr || view == nullptr) return;
  const modar_pose asked = modar::grown(*theirs);
  const modar_pose* const pose = &asked;
  if (!modar::usable(asked.rotation, 9) || !modar::usable(asked.translation, 3) ||
      !modar::usable(asked.stretch, 12)) {
    return;
  }
  modar::Pose ours;
  glm::dmat4x3 stretch(1.0);
  const bool none = std::all_of(std::begin(pose->stretch), std::end(pose->stretch),
                                [](float value) { return value == 0.0f; });
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4 && !none; ++column) {
      stretch[column][row] = static_cast<double>(pose->stretch[4 * row + column]);
    }
    for (int column = 0; column < 3; ++column) {
      ours.rotation[column][row] = static_cast<double>(pose->rotation[3 * row + column]);
    }
    ours.translation[row] = static_cast<double>(pose->translation[row]);
  }
  modar::copy_matrix(modar::gl_view(ours, stretch), view);
}

void modar_item_place(modar_item* item, const modar_scene* scene, const modar_pose* pose) {
  if (item == nullptr || scene == nullptr || pose == nullptr) return;
  const modar_scene place = modar::grown(*scene);
  modar_item ours = modar::grown(*item);
  modar_view(pose, ours.world_to_eye);
  ours.model = place.model;
  modar::copy_matrix(glm::make_mat4(ours.world_to_eye) * glm::make_mat4(place.place), ours.to_eye);
  ours.scene = place.number;
  modar::give(ours, item);
}
