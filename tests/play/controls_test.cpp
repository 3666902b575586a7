// Keys and clicks, and what they make the player draw.
#include "runtime/play/controls.hpp"

#include <gtest/gtest.h>

#include "formats/bundle_writer.hpp"
#include "runtime/play/spot_pattern.hpp"

namespace modar {
namespace {

/// Three models without geometry, two patterns; a scene binds model p + 1 to pattern p.
class ControlsTest : public testing::Test {
 protected:
  void SetUp() override {
    BundleContent content;
    LayoutRecord layout{};
    layout.stride = 8;
    layout.attribute_count = 1;
    layout.attributes[0] = {static_cast<std::uint8_t>(Semantic::kPosition),
                            static_cast<std::uint8_t>(ComponentType::kI16),
                            3,
                            1,
                            0,
                            0};
    content.layouts.push_back(layout);
    for (const char* name : {"a", "b", "c"}) {
      ModelRecord model{};
      model.name = content.intern(name);
      model.scale = 1;
      content.models.push_back(model);
    }
    for (std::uint32_t i = 0; i < 2; ++i) {
      PatternRecord pattern{};
      pattern.name = content.intern(i == 0 ? "p" : "q");
      pattern.width = 100;
      pattern.height = 100;
      pattern.half_width = 1;
      pattern.half_height = 1;
      pattern.score = -1;
      content.patterns.push_back(pattern);
      SceneRecord scene{};
      scene.pattern = i;
      scene.model = i + 1;
      scene.scale = 2;
      scene.rotation[3] = 1;
      content.scenes.push_back(scene);
    }
    content.features.resize(2);
    auto encoded = encode_bundle(content);
    ASSERT_TRUE(encoded) << to_line(encoded.error());
    bytes_ = std::move(*encoded);
    auto view = BundleView::open(bytes_);
    ASSERT_TRUE(view) << to_line(view.error());
    view_ = *view;
    states_[0].shown = true;
    states_[1].shown = true;
    states_[1].pose.translation = {0, 0, 5};
  }

  std::vector<std::uint32_t> models(Controls& controls) {
    std::vector<DrawItem> items;
    controls.collect(states_, 0.0, {}, items);
    std::vector<std::uint32_t> models;
    for (const DrawItem& item : items) models.push_back(item.model);
    return models;
  }

  std::vector<std::byte> bytes_;
  BundleView view_;
  std::array<Hysteresis::State, 2> states_;
};

using Models = std::vector<std::uint32_t>;

void click(Controls& controls, glm::dvec2 at) {
  for (const Act act : {Act::kDown, Act::kUp}) controls.apply({act, at, {320, 240}});
}

TEST_F(ControlsTest, WithoutKeysTheScenesAreDrawn) {
  Controls controls(view_, false, false);
  EXPECT_EQ(models(controls), (Models{1, 2}));
  states_[0].shown = false;
  EXPECT_EQ(models(controls), (Models{2}));
}

TEST_F(ControlsTest, EachCopyOfAPatternHasItsContent) {
  Controls controls(view_, false, false);
  std::array<Hysteresis::State, 4> states{};  // p, q, and the second copies of both
  states[0].shown = states[2].shown = true;
  states[2].pose.translation = {1, 2, 6};
  std::vector<DrawItem> items;
  controls.collect(states, 0.0, {}, items);
  ASSERT_EQ(items.size(), 2u);
  EXPECT_EQ(items[0].model, 1u);
  EXPECT_EQ(items[1].model, 1u);
  EXPECT_EQ(items[1].world_to_eye[3], (glm::vec4{1, -2, -6, 1}));  // GL looks along -z
  states[0].shown = false;
  controls.collect(states, 0.1, {}, items);
  EXPECT_EQ(items.size(), 1u);
}

TEST_F(ControlsTest, ModelsComeInTurnAndTheScenesAfterTheLast) {
  Controls controls(view_, false, false);
  controls.apply({Act::kNextModel, {}});
  EXPECT_EQ(models(controls), (Models{0, 0}));
  controls.apply({Act::kNextModel, {}});
  controls.apply({Act::kNextModel, {}});
  EXPECT_EQ(models(controls), (Models{2, 2}));
  controls.apply({Act::kNextModel, {}});
  EXPECT_EQ(models(controls), (Models{1, 2}));
  controls.apply({Act::kPreviousModel, {}});
  EXPECT_EQ(models(controls), (Models{2, 2}));
}

TEST_F(ControlsTest, OnePatternAtATimeAndThenAllAgain) {
  Controls controls(view_, false, false);
  controls.apply({Act::kNextPattern, {}});
  EXPECT_TRUE(controls.wants(0));
  EXPECT_FALSE(controls.wants(1));
  EXPECT_EQ(models(controls), (Models{1}));
  controls.apply({Act::kNextPattern, {}});
  EXPECT_EQ(models(controls), (Models{2}));
  controls.apply({Act::kNextPattern, {}});
  EXPECT_EQ(models(controls), (Models{1, 2}));
}

TEST_F(ControlsTest, SizeChangesTheModelAndNotItsPlace) {
  Controls controls(view_, false, false);
  std::vector<DrawItem> before;
  controls.collect(states_, 0.0, {}, before);
  controls.apply({Act::kLarger, {}});
  std::vector<DrawItem> after;
  controls.collect(states_, 0.0, {}, after);
  EXPECT_FLOAT_EQ(after[1].to_eye[0][0], before[1].to_eye[0][0] * 1.1f);
  EXPECT_EQ(after[1].to_eye[3], before[1].to_eye[3]);
  controls.apply({Act::kSmaller, {}});
  for (int i = 0; i < 200; ++i) controls.apply({Act::kSmaller, {}});
  controls.collect(states_, 0.0, {}, after);
  EXPECT_FLOAT_EQ(after[1].to_eye[0][0], before[1].to_eye[0][0] * 0.2f) << "it never vanishes";
}

TEST_F(ControlsTest, AMouseAcrossThePictureTurnsModelsOnceAroundAndTapsNothing) {
  Controls controls(view_, false, false);
  std::vector<DrawItem> before;
  controls.collect(states_, 0.0, {}, before);
  controls.apply({Act::kDown, {40, 100}, {320, 240}});
  controls.apply({Act::kMove, {120, 100}, {320, 240}});
  controls.apply({Act::kUp, {120, 100}, {320, 240}});
  EXPECT_TRUE(controls.take_taps().empty());
  std::vector<DrawItem> after;
  controls.collect(states_, 0.0, {}, after);
  // A quarter: the model's x axis is where its y axis was.
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(after[1].to_eye[0][i], before[1].to_eye[1][i], 1e-5f) << i;
  EXPECT_EQ(after[1].to_eye[3], before[1].to_eye[3]);
}

TEST_F(ControlsTest, APatternMadeOnTheSpotBearsTheChosenModelElseTheFirst) {
  Controls controls(view_, false, false);
  std::vector<DrawItem> items;
  controls.collect_spot(std::span(states_).first(1), items);
  ASSERT_EQ(items.size(), 1u);
  EXPECT_EQ(items[0].model, 0u);
  controls.apply({Act::kPreviousModel, {}});
  controls.collect_spot(std::span(states_).first(1), items);
  EXPECT_EQ(items[0].model, 2u);
}

TEST_F(ControlsTest, SwitchesPauseAndEnd) {
  Controls controls(view_, true, false);
  EXPECT_TRUE(controls.outline());
  controls.apply({Act::kOutline, {}});
  EXPECT_FALSE(controls.outline());
  controls.apply({Act::kDisplay, {}});
  EXPECT_TRUE(controls.display());
  controls.apply({Act::kPause, {}});
  EXPECT_TRUE(controls.holds());
  controls.apply({Act::kPause, {}});
  EXPECT_FALSE(controls.holds());
  controls.apply({Act::kQuit, {}});
  EXPECT_TRUE(controls.quit());
}

TEST_F(ControlsTest, FourClicksOnAFrozenFrameMakeCorners) {
  Controls controls(view_, false, false);
  std::array<glm::dvec2, 4> corners{};
  click(controls, {1, 1});
  ASSERT_EQ(controls.take_taps().size(), 1u);
  controls.apply({Act::kFreeze, {}});
  for (int i = 0; i < 3; ++i) click(controls, {i, 2 * i});
  EXPECT_FALSE(controls.take_corners(corners));
  EXPECT_EQ(controls.corners().size(), 3u);
  click(controls, {9, 9});
  EXPECT_TRUE(controls.take_corners(corners));
  EXPECT_EQ(corners[2], glm::dvec2(2, 4));
  EXPECT_FALSE(controls.holds());
  controls.apply({Act::kFreeze, {}});
  controls.apply({Act::kQuit, {}});
  EXPECT_FALSE(controls.quit()) << "the first time it only leaves the frozen frame";
  EXPECT_FALSE(controls.holds());
}

TEST(SpotCorners, AnyOrderOfClicksBecomesOneOrder) {
  const std::array<glm::dvec2, 4> expected = {{{10, 12}, {110, 8}, {120, 95}, {5, 90}}};
  std::array<int, 4> order = {0, 1, 2, 3};
  do {
    std::array<glm::dvec2, 4> clicked;
    for (std::size_t i = 0; i < 4; ++i) clicked[i] = expected[static_cast<std::size_t>(order[i])];
    const auto corners = ordered_corners(clicked);
    ASSERT_TRUE(corners);
    EXPECT_EQ(*corners, expected);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(SpotCorners, RefusesWhatIsNoPattern) {
  EXPECT_FALSE(ordered_corners({{{0, 0}, {10, 0}, {10, 10}, {0, 10}}})) << "too small";
  EXPECT_FALSE(ordered_corners({{{0, 0}, {50, 0}, {100, 0}, {50, 80}}})) << "three in a row";
  EXPECT_FALSE(ordered_corners({{{0, 0}, {100, 0}, {30, 30}, {0, 100}}})) << "a dent";
}

}  // namespace
}  // namespace modar
