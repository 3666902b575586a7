// modar.h: the camera, which both halves know.
#include "runtime/capi/handles.hpp"

modar_camera modar_camera_default(int width, int height) {
  const modar::Camera ours = modar::default_camera(width, height);
  return {ours.width, ours.height, ours.fx, ours.fy, ours.cx, ours.cy, {}};
}

void modar_projection(const modar_camera* camera, double near_plane, double far_plane,
                      float projection[16]) {
  modar::copy_matrix(modar::gl_projection(modar::camera_of(*camera), near_plane, far_plane),
                     projection);
}
