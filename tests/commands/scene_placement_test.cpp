// Where models stand: GLM turns the axes, a box with known sides tells where the base must be.
#include <gtest/gtest.h>

#include <glm/gtc/quaternion.hpp>

#include "bake/bundle/bundle_builder.hpp"

namespace modar {
namespace {

glm::dquat rotation_of(const SceneRecord& scene) {
  return {scene.rotation[3], scene.rotation[0], scene.rotation[1], scene.rotation[2]};
}

TEST(Placement, UpAxisPointsAtTheCamera) {
  const glm::dvec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  for (std::size_t i = 0; i < std::size(axes); ++i) {
    SceneRequest request;
    request.up = static_cast<UpAxis>(i);
    const SceneRecord scene = place_scene(request, 0, 0, {1, 1, 1});
    const glm::dvec3 turned = rotation_of(scene) * axes[i];
    EXPECT_NEAR(turned.z, 1.0, 1e-6) << i;
    EXPECT_NEAR(glm::length(rotation_of(scene)), 1.0, 1e-6) << i;
  }
}

TEST(Placement, TheLowestPointTouchesThePattern) {
  const std::array<double, 3> sides = {2.0, 8.0, 4.0};  // normalised: 0.25, 1, 0.5 half sides
  const double half[] = {0.25, 1.0, 0.5, 0.25, 1.0, 0.5};
  for (std::size_t i = 0; i < std::size(half); ++i) {
    SceneRequest request;
    request.up = static_cast<UpAxis>(i);
    request.scale = 0.5;
    const SceneRecord scene = place_scene(request, 3, 7, sides);
    EXPECT_EQ(scene.pattern, 3u);
    EXPECT_EQ(scene.model, 7u);
    double lowest = 1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 point((corner & 1 ? 1 : -1) * half[0], (corner & 2 ? 1 : -1) * half[1],
                             (corner & 4 ? 1 : -1) * half[2]);
      lowest = std::min(lowest, (rotation_of(scene) * point).z * 0.5 + scene.offset[2]);
    }
    EXPECT_NEAR(lowest, 0.0, 1e-6) << i;
  }
}

TEST(Placement, CentredAndOffset) {
  SceneRequest request;
  request.centred = true;
  request.offset = {0.1, 0.2, 0.3};
  const SceneRecord scene = place_scene(request, 0, 0, {1, 2, 3});
  EXPECT_FLOAT_EQ(scene.offset[0], 0.1f);
  EXPECT_FLOAT_EQ(scene.offset[1], 0.2f);
  EXPECT_FLOAT_EQ(scene.offset[2], 0.3f);
}

TEST(Placement, APointHasNoHeight) {
  EXPECT_EQ(place_scene({}, 0, 0, {0, 0, 0}).offset[2], 0.0f);
}

}  // namespace
}  // namespace modar
