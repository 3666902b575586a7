// modar_pose as JavaScript and Java have it: one array of floats. POSE of
// runtime/extensions/web/engine.js and Poses.java have the same offsets; a test compares all four.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "modar/modar.h"

namespace modar {

/// Members of modar_pose, whose comments apply. view: modar_view() of the pose, which contains its
/// stretch.
struct PoseFloats {
  float visible;
  float shown;
  float inliers;
  float fit;
  float rotation[9];
  float translation[3];
  float corners[8];
  float view[16];
  float extended;
  float agreeing;
  float likeness;
  float position_sigma;
  float rotation_sigma;
};
inline constexpr std::size_t kPoseFloats = sizeof(PoseFloats) / sizeof(float);

inline PoseFloats pose_floats(const modar_pose& pose) {
  PoseFloats floats{};
  floats.visible = static_cast<float>(pose.visible);
  floats.shown = static_cast<float>(pose.shown);
  floats.inliers = static_cast<float>(pose.inliers);
  floats.fit = pose.fit;
  std::copy(std::begin(pose.rotation), std::end(pose.rotation), floats.rotation);
  std::copy(std::begin(pose.translation), std::end(pose.translation), floats.translation);
  std::copy(std::begin(pose.corners), std::end(pose.corners), floats.corners);
  modar_view(&pose, floats.view);
  floats.extended = static_cast<float>(pose.extended);
  floats.agreeing = pose.agreeing;
  floats.likeness = pose.likeness;
  floats.position_sigma = pose.position_sigma;
  floats.rotation_sigma = pose.rotation_sigma;
  return floats;
}

}  // namespace modar
