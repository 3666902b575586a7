// Where models stand: GLM turns the axes, a box with known sides or its eight corners tell where
// the base must be.
#include "bake/bundle/scene/scene_placement.hpp"

#include <gtest/gtest.h>

#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>

#include "bake/bundle/bundle_builder.hpp"

namespace modar {
namespace {

glm::dquat rotation_of(const SceneRecord& scene) {
  return {scene.rotation[3], scene.rotation[0], scene.rotation[1], scene.rotation[2]};
}

/// A picture 200 mm wide and 100 mm high: a unit of its plane is 100 mm.
BundleContent wide_picture(double width_mm = 200) {
  BundleContent content;
  PatternRecord pattern{};
  pattern.width = 400;
  pattern.height = 200;
  pattern.half_width = 1.0f;
  pattern.half_height = 0.5f;
  pattern.width_mm = width_mm;
  content.patterns.push_back(pattern);
  return content;
}

SceneRequest standing(UpAxis up) {
  SceneRequest request;
  request.up = up;
  return request;
}

TEST(Placement, UpAxisPointsAtTheCamera) {
  const glm::dvec3 axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  for (std::size_t i = 0; i < std::size(axes); ++i) {
    const SceneRecord scene =
        place_scene(standing(static_cast<UpAxis>(i)), wide_picture(), 0, {0, {1, 1, 1}});
    const glm::dvec3 turned = rotation_of(scene) * axes[i];
    EXPECT_NEAR(turned.z, 1.0, 1e-6) << i;
    EXPECT_NEAR(glm::length(rotation_of(scene)), 1.0, 1e-6) << i;
  }
}

TEST(Placement, AModelThatFacesItsZLooksAtTheVisitorWhenYIsUp) {
  // glTF: the front of an asset faces +Z. Visitors stand where the pattern's y is negative.
  const SceneRecord scene = place_scene(standing(UpAxis::kY), wide_picture(), 0, {0, {1, 1, 1}});
  const glm::dvec3 front = rotation_of(scene) * glm::dvec3(0, 0, 1);
  EXPECT_NEAR(front.y, -1.0, 1e-6);
}

TEST(Placement, TheLowestPointTouchesThePattern) {
  const std::array<double, 3> sides = {2.0, 8.0, 4.0};  // normalised: 0.25, 1, 0.5 half sides
  const double half[] = {0.25, 1.0, 0.5, 0.25, 1.0, 0.5};
  for (std::size_t i = 0; i < std::size(half); ++i) {
    SceneRequest request = standing(static_cast<UpAxis>(i));
    request.size.value = 0.5;
    const SceneRecord scene = place_scene(request, wide_picture(), 0, {7, sides});
    EXPECT_EQ(scene.pattern, 0u);
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
  SceneRequest request = standing(UpAxis::kZ);
  request.centred = true;
  request.offset = {SceneOffset::Unit::kSide, {0.1, 0.2, 0.3}};
  const SceneRecord scene = place_scene(request, wide_picture(), 0, {0, {1, 2, 3}});
  EXPECT_FLOAT_EQ(scene.offset[0], 0.2f);  // a side is two units of the plane
  EXPECT_FLOAT_EQ(scene.offset[1], 0.4f);
  EXPECT_FLOAT_EQ(scene.offset[2], 0.6f);
}

TEST(Placement, APointHasNoHeight) {
  EXPECT_EQ(place_scene(standing(UpAxis::kZ), wide_picture(), 0, {0, {0, 0, 0}}).offset[2], 0.0f);
}

TEST(Placement, TurnsAboutThePatternsAxesInTheirOrder) {
  SceneRequest request = standing(UpAxis::kY);
  request.turn = {0, 0, 90};
  const SceneRecord quarter = place_scene(request, wide_picture(), 0, {0, {1, 1, 1}});
  // The front, which looked at the visitor, now looks at the pattern's right.
  EXPECT_NEAR((rotation_of(quarter) * glm::dvec3(0, 0, 1)).x, 1.0, 1e-6);
  EXPECT_NEAR((rotation_of(quarter) * glm::dvec3(0, 1, 0)).z, 1.0, 1e-6);
  request.up = UpAxis::kZ;
  request.turn = {90, 0, 90};
  const SceneRecord both = place_scene(request, wide_picture(), 0, {0, {1, 1, 1}});
  // z to -y by the turn about x, then -y to x by the turn about z.
  EXPECT_NEAR((rotation_of(both) * glm::dvec3(0, 0, 1)).x, 1.0, 1e-6);
}

TEST(Placement, MillimetresNeedAWidth) {
  SceneRequest request = standing(UpAxis::kZ);
  request.size = {SceneSize::Kind::kHeight, 50};
  const auto refused = resolve_scene(request, wide_picture(0), 0, {0, {1, 1, 1}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "scene.no-width");
  EXPECT_NE(refused.error().cure.find("in modar.toml width = "), std::string::npos);
  // Sides 1, 2, 4: z is the largest, 2 units high at scale 1, which are 200 mm.
  const auto tall = resolve_scene(request, wide_picture(), 0, {0, {1, 2, 4}});
  ASSERT_TRUE(tall);
  EXPECT_EQ(tall->size.kind, SceneSize::Kind::kScale);
  EXPECT_DOUBLE_EQ(tall->size.value, 0.25);
  request.up = UpAxis::kX;  // now 50 mm high at scale 1
  EXPECT_DOUBLE_EQ(resolve_scene(request, wide_picture(), 0, {0, {1, 2, 4}})->size.value, 1.0);
  request.size.kind = SceneSize::Kind::kWidth;  // x of the pattern is the model's -z or z
  EXPECT_DOUBLE_EQ(resolve_scene(request, wide_picture(), 0, {0, {1, 2, 4}})->size.value, 0.25);
  request.up = UpAxis::kZ;
  EXPECT_EQ(resolve_scene(request, wide_picture(), 0, {0, {0, 2, 4}}).error().code, "scene.flat");
}

TEST(Placement, AFlatModelHasNoSizeToGive) {
  SceneRequest request = standing(UpAxis::kZ);
  request.size = {SceneSize::Kind::kWidth, 50};
  const auto code = [&](std::array<double, 3> sides) {
    const auto resolved = resolve_scene(request, wide_picture(), 0, {0, sides});
    return resolved ? "" : resolved.error().code;
  };
  EXPECT_EQ(code({3.99e-4, 2, 4}), "scene.flat");  // less than 1 / 10,000 of the largest side
  EXPECT_EQ(code({4.01e-4, 2, 4}), "");
  EXPECT_EQ(code({0, 0, 0}), "scene.flat");
  request.size.kind = SceneSize::Kind::kHeight;
  EXPECT_EQ(code({2, 4, 3.99e-4}), "scene.flat");
  EXPECT_EQ(code({2, 4, 4.01e-4}), "");
  request.up = UpAxis::kY;
  EXPECT_EQ(code({2, 1e-40, 4}), "scene.flat");
  // A unit is 100 mm, and the model is 2 units high at scale 1.
  request.size.value = 2.00001e8;
  EXPECT_EQ(code({1, 1, 1}), "scene.size");
  request.size.value = 1.99999e8;
  EXPECT_EQ(code({1, 1, 1}), "");
  request.size.value = 1.99999e-4;
  EXPECT_EQ(code({1, 1, 1}), "scene.size");
  request.size.value = 2.00001e-4;
  EXPECT_EQ(code({1, 1, 1}), "");
}

TEST(Placement, OffsetsAreMillimetresWhereTheWidthIsKnown) {
  SceneRequest request = standing(UpAxis::kZ);
  request.offset.value = {10, 0, 20};
  const auto known = resolve_scene(request, wide_picture(), 0, {0, {1, 1, 1}});
  ASSERT_TRUE(known);
  EXPECT_DOUBLE_EQ(known->offset.value[0], 0.05);
  EXPECT_DOUBLE_EQ(known->offset.value[2], 0.1);
  const auto unknown = resolve_scene(request, wide_picture(0), 0, {0, {1, 1, 1}});
  ASSERT_TRUE(unknown);
  EXPECT_DOUBLE_EQ(unknown->offset.value[0], 10);
  request.offset.unit = SceneOffset::Unit::kMillimetres;
  EXPECT_FALSE(resolve_scene(request, wide_picture(0), 0, {0, {1, 1, 1}}));
}

TEST(Placement, WhatNobodyTurnedStandsAsTheModelSays) {
  const auto resolved = resolve_scene({}, wide_picture(), 0, {0, {1, 1, 1}, UpAxis::kMinusX});
  ASSERT_TRUE(resolved);
  EXPECT_EQ(resolved->up, UpAxis::kMinusX);
}

}  // namespace
}  // namespace modar
