// modar.h: our pose loop, the two-frame rule, and poses as GL's matrices.
#include <memory>
#include <vector>

#include "modar/pose_loop.hpp"
#include "runtime/capi/handles.hpp"

struct modar_tracker {
  modar::Camera camera;
  std::unique_ptr<modar::PoseLoop> loop;
  modar::Hysteresis hysteresis;
  modar::TrackResult result;
  std::vector<modar_pose> poses;  ///< one a pattern
};

namespace {

void set_pose(const modar::Pose& from, modar_pose& to) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      to.rotation[3 * row + column] = static_cast<float>(from.rotation[column][row]);
    }
    to.translation[row] = static_cast<float>(from.translation[row]);
  }
}

}  // namespace

modar_tracker* modar_tracker_create(const modar_bundle* bundle, const modar_camera* camera,
                                    modar_error* error) {
  if (bundle == nullptr || camera == nullptr) {
    modar::hand_over(modar::missing(bundle == nullptr ? "bundle" : "camera"), error);
    return nullptr;
  }
  const modar::Camera ours = modar::camera_of(*camera);
  auto loop = modar::PoseLoop::create(bundle->view, ours);
  if (!loop) {
    modar::hand_over(loop.error(), error);
    return nullptr;
  }
  const std::size_t patterns = bundle->view.patterns().size();
  return new modar_tracker{
      ours, std::move(*loop), modar::Hysteresis(patterns), {}, std::vector<modar_pose>(patterns)};
}

void modar_tracker_destroy(modar_tracker* tracker) {
  delete tracker;
}

int modar_tracker_step(modar_tracker* tracker, const uint8_t* gray, size_t stride,
                       modar_error* error) {
  if (gray == nullptr) return modar::hand_over(modar::missing("gray"), error);
  const modar::Camera& camera = tracker->camera;
  const auto done = tracker->loop->step(
      {gray, camera.width, camera.height, static_cast<std::ptrdiff_t>(stride)}, tracker->result);
  if (!done) return modar::hand_over(done, error);
  const auto states = tracker->hysteresis.step(tracker->result.visible);
  for (std::size_t i = 0; i < states.size(); ++i) {
    modar_pose& pose = tracker->poses[i];
    pose.shown = states[i].shown ? 1 : 0;
    pose.visible = 0;
    pose.inliers = 0;
    if (states[i].shown) set_pose(states[i].pose, pose);
  }
  for (const modar::Detection& seen : tracker->result.visible) {
    modar_pose& pose = tracker->poses[seen.pattern];
    set_pose(seen.pose, pose);
    pose.visible = 1;
    pose.inliers = seen.inliers;
    for (std::size_t i = 0; i < seen.corners.size(); ++i) {
      pose.corners[2 * i] = static_cast<float>(seen.corners[i].x);
      pose.corners[2 * i + 1] = static_cast<float>(seen.corners[i].y);
    }
  }
  return 0;
}

int modar_tracker_pose(const modar_tracker* tracker, uint32_t pattern, modar_pose* pose) {
  if (pattern >= tracker->poses.size()) return 0;
  *pose = tracker->poses[pattern];
  return pose->visible;
}

const char* modar_tracker_reason(const modar_tracker* tracker) {
  return modar::to_string(tracker->result.reason);
}

void modar_view(const modar_pose* pose, float view[16]) {
  modar::Pose ours;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      ours.rotation[column][row] = static_cast<double>(pose->rotation[3 * row + column]);
    }
    ours.translation[row] = static_cast<double>(pose->translation[row]);
  }
  modar::copy_matrix(modar::gl_view(ours), view);
}

void modar_item_place(modar_item* item, const modar_scene* scene, const modar_pose* pose) {
  float view[16];
  modar_view(pose, view);
  item->model = scene->model;
  modar::copy_matrix(glm::make_mat4(view) * glm::make_mat4(scene->place), item->to_eye);
}
