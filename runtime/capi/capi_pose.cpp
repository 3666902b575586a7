// modar.h: from a pose to GL's matrices.
#include "modar/pose.hpp"
#include "runtime/capi/handles.hpp"

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
