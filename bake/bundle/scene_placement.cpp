// Where a model stands on a pattern.
#include <algorithm>
#include <cmath>

#include "bake/bundle/bundle_builder.hpp"

namespace modar {
namespace {

/// Rotation (unit quaternion x, y, z, w) that takes the axis to +z, and the index of the axis.
struct AxisTurn {
  std::array<double, 4> quaternion;
  std::size_t axis;
};

AxisTurn turn_to_z(UpAxis up) {
  const double h = std::sqrt(0.5);
  switch (up) {
    case UpAxis::kX:
      return {{0, -h, 0, h}, 0};
    case UpAxis::kMinusX:
      return {{0, h, 0, h}, 0};
    case UpAxis::kY:
      return {{h, 0, 0, h}, 1};
    case UpAxis::kMinusY:
      return {{-h, 0, 0, h}, 1};
    case UpAxis::kMinusZ:
      return {{1, 0, 0, 0}, 2};
    case UpAxis::kZ:
      break;
  }
  return {{0, 0, 0, 1}, 2};
}

}  // namespace

SceneRecord place_scene(const SceneRequest& request, std::uint32_t pattern, std::uint32_t model,
                        const std::array<double, 3>& model_sides) {
  const AxisTurn turn = turn_to_z(request.up);
  const double largest = *std::max_element(model_sides.begin(), model_sides.end());
  const double half_height = largest > 0 ? model_sides[turn.axis] / largest : 0.0;
  SceneRecord scene{};
  scene.pattern = pattern;
  scene.model = model;
  scene.scale = static_cast<float>(request.scale);
  for (std::size_t i = 0; i < 3; ++i) scene.offset[i] = static_cast<float>(request.offset[i]);
  if (!request.centred) {
    scene.offset[2] = static_cast<float>(request.offset[2] + request.scale * half_height);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    scene.rotation[i] = static_cast<float>(turn.quaternion[i]);
  }
  return scene;
}

}  // namespace modar
