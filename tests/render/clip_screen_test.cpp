// Clips through the C API: lists, clocks, and no memory a frame.
#include <gtest/gtest.h>

#include "modar/modar.h"
#include "tests/formats/allocation_counter.hpp"
#include "tests/formats/support.hpp"
#include "tests/render/moving_model.hpp"

namespace modar::test {
namespace {

constexpr float kUnturned[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

class ClipScreenTest : public testing::Test {
 protected:
  explicit ClipScreenTest(const BundleContent& content = moving_content(2))
      : bytes_(encode(content)) {
    bundle_ = modar_bundle_open_bytes(bytes_.data(), bytes_.size(), nullptr);
    screen_ = modar_screen_create(bundle_, nullptr);
  }
  ~ClipScreenTest() override {
    modar_screen_destroy(screen_);
    modar_bundle_close(bundle_);
  }

  void step(double time_s, bool seen = true) {
    const modar_event event = {sizeof event, MODAR_SEEN, 0, 0, 0};
    modar_screen_step(screen_, time_s, &event, seen ? 1 : 0);
  }
  std::vector<float> bones(uint32_t scene) {
    std::vector<float> rows(modar_clip_bones(screen_, scene, nullptr, 0));
    modar_clip_bones(screen_, scene, rows.data(), rows.size());
    return rows;
  }
  void expect_at(uint32_t scene, int clip, double seconds) {
    const auto expected = bone_matrices(joint_states(clip, seconds));
    const auto found = bones(scene);
    ASSERT_EQ(found.size(), 12 * expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      const int at = static_cast<int>(i % 12);
      EXPECT_NEAR(static_cast<double>(found[i]), expected[i / 12][at % 4][at / 4], 3e-4) << i;
    }
  }

  std::vector<std::byte> bytes_;
  modar_bundle* bundle_ = nullptr;
  modar_screen* screen_ = nullptr;
};

TEST_F(ClipScreenTest, ListsClips) {
  ASSERT_EQ(modar_clip_count(bundle_), 2u);
  auto clip = sized<modar_clip>();
  ASSERT_EQ(modar_clip_at(bundle_, 1, &clip), 1);
  EXPECT_EQ(clip.model, 0u);
  EXPECT_EQ(clip.seconds, 0.5f);
  char name[8] = "";
  EXPECT_EQ(modar_clip_name(bundle_, 1, name, sizeof name), 4u);
  EXPECT_STREQ(name, "wave");
  EXPECT_EQ(modar_clip_at(bundle_, 2, &clip), 0);
}

TEST_F(ClipScreenTest, BeginsWhenItsPatternIsFound) {
  step(10, false);
  step(11, false);
  EXPECT_EQ(bones(0).size(), 0u);
  EXPECT_EQ(modar_screen_waiting(screen_), 0);
  step(20);
  expect_at(0, 0, 0);
  EXPECT_EQ(modar_screen_waiting(screen_), 1);
  step(20.25);
  expect_at(0, 0, 0.25);
  step(21.5, false);
  EXPECT_EQ(modar_screen_waiting(screen_), 0) << "nobody sees it";
  step(21.75);
  expect_at(0, 0, 0.75);
  EXPECT_EQ(modar_clip_playing(screen_, 0), 1u);
  modar_screen_reset(screen_);
  EXPECT_EQ(bones(0).size(), 0u);
  step(30);
  expect_at(0, 0, 0);
}

TEST_F(ClipScreenTest, ScenesHaveTheirOwnClocks) {
  step(0);
  step(0.4);
  ASSERT_EQ(modar_clip_play(screen_, 1, 1, 0, 0), 1);
  step(0.4);  // from this step on, whenever the one before was
  step(0.6);
  expect_at(0, 0, 0.6);
  expect_at(1, 1, 0.2);
  EXPECT_EQ(modar_clip_playing(screen_, 1), 2u);
  step(1.6);
  EXPECT_EQ(modar_clip_playing(screen_, 1), 0u) << "it has ended";
  expect_at(1, 1, 0.5);
  modar_clip_stop(screen_, 0);
  step(1.8);
  expect_at(0, 0, 0.6);
  EXPECT_EQ(modar_screen_waiting(screen_), 0);
  EXPECT_EQ(modar_clip_play(screen_, 2, 0, 0, 0), 0);
  EXPECT_EQ(modar_clip_play(screen_, 0, 2, 0, 0), 0);
}

TEST_F(ClipScreenTest, AnAppsClipReplacesTheBundles) {
  modar_clip_play(screen_, 0, 1, 1, 0);
  step(500);
  step(500.1);
  EXPECT_EQ(modar_clip_playing(screen_, 0), 2u);
  expect_at(0, 1, 0.1);
}

TEST_F(ClipScreenTest, AClipBeginsAtTheNextStep) {
  step(0);
  modar_clip_play(screen_, 0, 1, 0, 0);
  step(100);
  expect_at(0, 1, 0);
  step(100.2);
  expect_at(0, 1, 0.2);
}

TEST_F(ClipScreenTest, WaitsWhilePaused) {
  step(0);
  modar_screen_press(screen_, MODAR_PAUSED, 1);
  step(0.5);
  expect_at(0, 0, 0);
  EXPECT_EQ(modar_screen_waiting(screen_), 0);
  modar_screen_press(screen_, MODAR_PAUSED, 1);
  step(0.7);
  expect_at(0, 0, 0.2);
}

TEST_F(ClipScreenTest, ItemsHaveThePose) {
  modar_item items[4] = {sized<modar_item>()};
  EXPECT_EQ(modar_screen_items(screen_, 0, kUnturned, items, 4), 2u);
  EXPECT_EQ(items[0].bones, nullptr);
  step(0);
  step(0.3);
  modar_screen_items(screen_, 0, kUnturned, items, 4);
  ASSERT_NE(items[1].bones, nullptr);
  EXPECT_EQ(items[1].bones[3], bones(1)[3]);
}

/// found: wave once; tap on the model: walk; after 3 s: stop.
BundleContent acting_model() {
  BundleContent content = moving_content(1);
  NodeRecord node{};
  node.name = content.intern("strip");
  node.kind = static_cast<std::uint32_t>(NodeKind::kModel);
  node.rotation[3] = 1;
  content.nodes.push_back(node);
  const auto add = [&](ActionEvent event, ActionCommand command, const char* clip, float seconds) {
    ActionRecord action{};
    action.event = static_cast<std::uint32_t>(event);
    action.command = static_cast<std::uint32_t>(command);
    action.address = content.intern(clip);
    action.seconds = seconds;
    content.actions.push_back(action);
  };
  add(ActionEvent::kFound, ActionCommand::kClipOnce, "wave", 0);
  add(ActionEvent::kTap, ActionCommand::kClip, "walk", 0);
  add(ActionEvent::kAfter, ActionCommand::kStop, "", 3);
  return content;
}

class ClipActionTest : public ClipScreenTest {
 protected:
  ClipActionTest() : ClipScreenTest(acting_model()) {}
};

TEST_F(ClipActionTest, PlaysAndStops) {
  step(0);
  EXPECT_EQ(modar_clip_playing(screen_, 0), 2u);
  step(0.4);
  expect_at(0, 1, 0.4);
  step(0.9);
  expect_at(0, 1, 0.5);
  const modar_event events[] = {{sizeof events[0], MODAR_SEEN, 0, 0, 0},
                                {sizeof events[0], MODAR_TAP, 0, 0, 0}};
  EXPECT_EQ(modar_screen_step(screen_, 1.0, events, 2), 0u) << "nothing for the app to do";
  EXPECT_EQ(modar_clip_playing(screen_, 0), 1u);
  expect_at(0, 1, 0.5);
  step(1.5);
  step(2.6);
  expect_at(0, 0, 0.6);
  step(3.1);
  EXPECT_EQ(modar_clip_playing(screen_, 0), 0u);
  step(9);
  expect_at(0, 0, 0.1);
}

TEST(ClipActionRuleTest, NamesAClipOfItsModel) {
  const auto opens = [](const BundleContent& content) {
    const auto bytes = encode(content);
    modar_bundle* bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), nullptr);
    modar_bundle_close(bundle);
    return bundle != nullptr;
  };
  BundleContent content = acting_model();
  EXPECT_TRUE(opens(content));
  content.actions[0].address = content.intern("jump");
  EXPECT_FALSE(opens(content));
  content = acting_model();
  content.actions[2].address = content.intern("walk");
  EXPECT_FALSE(opens(content)) << "nothing is played";
}

TEST_F(ClipScreenTest, AllocatesNothingAFrame) {
  step(0);
  modar_item items[4] = {sized<modar_item>()};
  const std::size_t before = allocation_count();
  for (int frame = 1; frame < 100; ++frame) {
    step(frame / 30.0);
    if (frame % 20 == 0) modar_clip_play(screen_, 0, frame % 40 == 0 ? 1 : 0, 1, 0.3);
    modar_screen_items(screen_, 0, kUnturned, items, 4);
  }
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace
}  // namespace modar::test
