// Where a scene puts its model, and the depth limits around it.
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

#include "tests/render/scene.hpp"

namespace modar {
namespace {

TEST(SceneMath, ScaleThenTurnThenShift) {
  SceneRecord scene{};
  scene.scale = 0.5f;
  scene.offset[0] = 0.1f;
  scene.offset[2] = -0.2f;
  // A quarter turn about z: x becomes y.
  scene.rotation[2] = std::sqrt(0.5f);
  scene.rotation[3] = std::sqrt(0.5f);
  const glm::vec4 point = scene_matrix(scene) * glm::vec4(1.0f, 0.0f, 0.4f, 1.0f);
  EXPECT_NEAR(point.x, 0.1f, 1e-6f);
  EXPECT_NEAR(point.y, 0.5f, 1e-6f);
  EXPECT_NEAR(point.z, 0.0f, 1e-6f);
}

TEST(SceneMath, DepthRangeEnclosesEveryCornerTightly) {
  SceneMaker maker;
  Triangle triangle;
  triangle.corners = {glm::dvec3(-1, -1, -0.5), {1, -1, 0.5}, {0, 1, 0}};
  maker.add_plain_model(Layout::kF32Coloured, {triangle});
  const MappedBundle bundle(maker.content);
  for (int turn = 0; turn < 12; ++turn) {
    glm::mat4 to_eye = glm::translate(glm::mat4(1.0f), glm::vec3(0.3f, 0.1f, -5.0f));
    to_eye = glm::rotate(to_eye, 0.5f * static_cast<float>(turn), glm::vec3(0.36f, 0.48f, 0.8f));
    const DrawItem item{0, to_eye};
    double nearest = 1e9;
    double farthest = -1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec4 p((corner & 1) != 0 ? 1.0 : -1.0, (corner & 2) != 0 ? 1.0 : -1.0,
                         (corner & 4) != 0 ? 0.5 : -0.5, 1.0);
      const double depth = -(glm::dmat4(to_eye) * p).z;
      nearest = std::min(nearest, depth);
      farthest = std::max(farthest, depth);
    }
    const DepthRange range = depth_range(*bundle.view, {&item, 1});
    EXPECT_LT(range.near_plane, nearest);
    EXPECT_GT(range.near_plane, nearest * 0.98);
    EXPECT_GT(range.far_plane, farthest);
    EXPECT_LT(range.far_plane, farthest * 1.02);
  }
}

TEST(SceneMath, DepthRangeStaysPositiveAroundAndBehindTheEye) {
  SceneMaker maker;
  Triangle triangle;
  triangle.corners = {glm::dvec3(-1, -1, -1), {1, -1, 1}, {0, 1, 0}};
  maker.add_plain_model(Layout::kF32Coloured, {triangle});
  const MappedBundle bundle(maker.content);
  for (const float z : {0.0f, 0.9f, 5.0f}) {
    const DrawItem item{0, glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, z))};
    const DepthRange range = depth_range(*bundle.view, {&item, 1});
    EXPECT_GT(range.near_plane, 0.0);
    EXPECT_GT(range.far_plane, range.near_plane);
  }
  const DepthRange nothing = depth_range(*bundle.view, {});
  EXPECT_GT(nothing.far_plane, nothing.near_plane);
}

}  // namespace
}  // namespace modar
