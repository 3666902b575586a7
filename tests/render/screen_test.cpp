// The screen through the C API: what fingers, keys and time do to the models and to the eye.
#include <array>
#include <cstring>
#include <numbers>
#include <optional>

#include <gtest/gtest.h>

#include "modar/modar.h"
#include "tests/formats/allocation_counter.hpp"
#include "tests/formats/support.hpp"

namespace modar {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr float kStill[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/// A screen of 400 x 200 units.
class ScreenTest : public testing::Test {
 protected:
  ScreenTest() : bytes_(test::encode(test::acting_content())) {
    bundle_ = modar_bundle_open_bytes(bytes_.data(), bytes_.size(), nullptr);
    screen_ = modar_screen_create(bundle_, nullptr);
  }
  ~ScreenTest() override {
    modar_screen_destroy(screen_);
    modar_bundle_close(bundle_);
  }

  int touch(int kind, double x, double y, int finger = 1) {
    const modar_touch touch = {sizeof touch, kind, finger, x, y, 400, 200};
    return modar_screen_touch(screen_, &touch);
  }
  modar_turntable at(double time_s = 0) {
    auto from = sized<modar_turntable>();
    EXPECT_EQ(modar_screen_turntable(screen_, time_s, &from), 1);
    return from;
  }
  modar_status status() {
    auto status = sized<modar_status>();
    modar_screen_status(screen_, &status);
    return status;
  }
  /// A frame without a pattern: what the visitor reads.
  int hint(double time_s, int reason, double brightness = 100) {
    modar_screen_follow(screen_, time_s, 0, reason, brightness);
    return status().hint;
  }
  /// What of the first pattern is drawn of a kind: a model has a scene, a picture has none.
  std::optional<modar_item> item(bool model, std::uint32_t pattern = 0) {
    modar_item items[8] = {sized<modar_item>()};
    const std::size_t count = modar_screen_items(screen_, pattern, kStill, items, 8);
    for (std::size_t i = 0; i < count; ++i) {
      if ((items[i].scene != 0) == model) return items[i];
    }
    return std::nullopt;
  }

  std::vector<std::byte> bytes_;
  modar_bundle* bundle_ = nullptr;
  modar_screen* screen_ = nullptr;
};

TEST_F(ScreenTest, BeginsFacingThePatternFrom32Degrees) {
  EXPECT_EQ(at().turn, 0);
  EXPECT_NEAR(at().tilt * 180 / kPi, 32, 1e-9);
  EXPECT_EQ(at().zoom, 1);
}

TEST_F(ScreenTest, AFingerAcrossTheScreenTurnsOnceAround) {
  EXPECT_EQ(touch(MODAR_TOUCH_DOWN, 100, 100), MODAR_NOTHING);
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 200, 100), MODAR_MOVED);
  EXPECT_NEAR(at().turn, kPi / 2, 1e-9);
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 50, 100), MODAR_MOVED);
  EXPECT_NEAR(at().turn, 2 * kPi - kPi / 4, 1e-9) << "0 to 2 pi";
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 50, 110), MODAR_MOVED);
  EXPECT_NEAR(at().tilt * 180 / kPi, 32 + 9, 1e-9) << "along it, half around";
  EXPECT_EQ(touch(MODAR_TOUCH_UP, 50, 110), MODAR_NOTHING) << "no tap";
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 100, 100), MODAR_NOTHING) << "a mouse without its button";
}

TEST_F(ScreenTest, TheEyeStaysBetween8And86Degrees) {
  touch(MODAR_TOUCH_DOWN, 100, 0);
  touch(MODAR_TOUCH_MOVE, 100, 190);
  EXPECT_NEAR(at().tilt * 180 / kPi, 86, 1e-9);
  touch(MODAR_TOUCH_MOVE, 100, 0);
  EXPECT_NEAR(at().tilt * 180 / kPi, 8, 1e-9);
}

TEST_F(ScreenTest, AFingerThatStaysTaps) {
  touch(MODAR_TOUCH_DOWN, 100, 100);
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 102, 102), MODAR_NOTHING) << "1.4 % of 200";
  EXPECT_EQ(touch(MODAR_TOUCH_UP, 102, 102), MODAR_TAPPED);
  EXPECT_EQ(at().turn, 0);
  touch(MODAR_TOUCH_DOWN, 100, 100);
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 104, 100), MODAR_MOVED);
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 100, 100), MODAR_MOVED);
  EXPECT_EQ(touch(MODAR_TOUCH_UP, 100, 100), MODAR_NOTHING) << "it was elsewhere";
  touch(MODAR_TOUCH_DOWN, 100, 100);
  EXPECT_EQ(touch(MODAR_TOUCH_CANCEL, 100, 100), MODAR_NOTHING);
  touch(MODAR_TOUCH_DOWN, 100, 100, 1);
  touch(MODAR_TOUCH_DOWN, 100, 100, 2);
  EXPECT_EQ(touch(MODAR_TOUCH_UP, 100, 100, 2), MODAR_NOTHING) << "two do not tap";
  EXPECT_EQ(touch(MODAR_TOUCH_UP, 100, 100, 1), MODAR_NOTHING);
}

TEST_F(ScreenTest, TwoFingersResizeFromAFifthToFiveTimes) {
  touch(MODAR_TOUCH_DOWN, 100, 100, 4);
  touch(MODAR_TOUCH_DOWN, 130, 140, 9);  // 50 apart
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 160, 180, 9), MODAR_MOVED);
  EXPECT_NEAR(at().zoom, 2, 1e-9);
  EXPECT_EQ(touch(MODAR_TOUCH_DOWN, 0, 0, 11), MODAR_NOTHING) << "a third finger";
  EXPECT_EQ(touch(MODAR_TOUCH_MOVE, 300, 0, 11), MODAR_NOTHING);
  EXPECT_NEAR(at().zoom, 2, 1e-9);
  EXPECT_EQ(at().turn, 0);
  touch(MODAR_TOUCH_MOVE, 100, 100, 9);
  touch(MODAR_TOUCH_MOVE, 101, 100, 9);
  touch(MODAR_TOUCH_MOVE, 399, 100, 9);
  EXPECT_EQ(at().zoom, 5);
  touch(MODAR_TOUCH_MOVE, 101, 100, 9);
  EXPECT_EQ(at().zoom, 0.2);
  EXPECT_EQ(touch(MODAR_TOUCH_UP, 100, 100, 4), MODAR_NOTHING) << "two do not tap";
  touch(MODAR_TOUCH_MOVE, 201, 100, 9);
  EXPECT_NEAR(at().turn, kPi / 2, 1e-9) << "the other one turns from where it is";
  EXPECT_EQ(touch(MODAR_TOUCH_UP, 201, 100, 9), MODAR_NOTHING);
}

TEST_F(ScreenTest, KeysAndButtonsDoTheSameInSteps) {
  modar_screen_press(screen_, MODAR_TURN, -1);
  EXPECT_NEAR(at().turn * 180 / kPi, 350, 1e-9);
  modar_screen_press(screen_, MODAR_TILT, 2);
  EXPECT_NEAR(at().tilt * 180 / kPi, 52, 1e-9);
  modar_screen_press(screen_, MODAR_SIZE, 1);
  EXPECT_NEAR(at().zoom, 1.1, 1e-9);
  modar_screen_press(screen_, MODAR_SIZE, -1);
  EXPECT_NEAR(at().zoom, 1, 1e-9);
  modar_screen_press(screen_, MODAR_SIZE, -1000);
  EXPECT_EQ(at().zoom, 0.2);
  modar_screen_press(screen_, MODAR_RESET, 1);
  EXPECT_EQ(at().turn, 0);
  EXPECT_NEAR(at().tilt * 180 / kPi, 32, 1e-9);
  EXPECT_EQ(at().zoom, 1);
}

TEST_F(ScreenTest, ButtonsThatAreNoneDoNothing) {
  const auto switches = [this] {
    return std::array{status().sound, status().paused, status().captions};
  };
  const auto before = switches();
  for (const int button : {MODAR_TURN - 1, MODAR_CAPTIONS_SHOWN + 1, 99}) {
    modar_screen_press(screen_, button, 1);
    EXPECT_EQ(switches(), before) << button;
  }
  modar_screen_press(screen_, MODAR_CAPTIONS_SHOWN, 1);
  EXPECT_EQ(switches()[2], 1 - before[2]);
}

TEST_F(ScreenTest, ModelsTurnAndGrowAboutTheirFeetAndPicturesStay) {
  const auto before = item(true);
  const auto picture = item(false);
  ASSERT_TRUE(before && picture);
  modar_screen_press(screen_, MODAR_TURN, 9);  // a quarter
  modar_screen_press(screen_, MODAR_SIZE, 10);
  EXPECT_EQ(std::memcmp(item(false)->to_eye, picture->to_eye, sizeof picture->to_eye), 0);
  const auto after = item(true);
  for (int i = 0; i < 12; i += 4) {
    EXPECT_NEAR(after->to_eye[i], -2 * before->to_eye[i + 1], 1e-5f);
    EXPECT_NEAR(after->to_eye[i + 1], 2 * before->to_eye[i], 1e-5f);
    EXPECT_NEAR(after->to_eye[i + 2], 2 * before->to_eye[i + 2], 1e-5f);
  }
  EXPECT_EQ(after->to_eye[12], before->to_eye[12]);
  EXPECT_EQ(after->to_eye[13], before->to_eye[13]);
  EXPECT_EQ(after->to_eye[14], 2 * before->to_eye[14]);
  EXPECT_EQ(after->to_eye[15], 1);
}

TEST_F(ScreenTest, APatternOfTheVisitorsOwnShowsAScenesModel) {
  const std::uint32_t own = modar_pattern_count(bundle_);
  EXPECT_FALSE(item(true, own));
  EXPECT_EQ(modar_screen_add_pattern(screen_, modar_scene_count(bundle_)), 0);
  const std::uint32_t last = modar_scene_count(bundle_) - 1;
  ASSERT_EQ(modar_screen_add_pattern(screen_, last), 1);
  auto scene = sized<modar_scene>();
  modar_scene_at(bundle_, last, &scene);
  const auto found = item(true, own);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->model, scene.model);
  EXPECT_EQ(found->scene, scene.number);
  for (int i = 0; i < 16; ++i) EXPECT_EQ(found->to_eye[i], scene.place[i]) << i;
  modar_screen_forget_patterns(screen_);
  EXPECT_FALSE(item(true, own));
}

TEST_F(ScreenTest, ALookAroundBeginsWithATurnInWhichModelsStay) {
  modar_screen_press(screen_, MODAR_SIZE, 3);
  modar_screen_look_around(screen_, 0, 10, 1);
  EXPECT_EQ(at(10).turn, 0);
  EXPECT_EQ(at(10).zoom, 1);
  const auto first = item(true);
  EXPECT_NEAR(at(12).turn, 2 * kPi * 7 / 8, 1e-9) << "half of the time: all but an eighth";
  EXPECT_EQ(modar_screen_waiting(screen_), 1);
  EXPECT_EQ(std::memcmp(item(true)->to_eye, first->to_eye, sizeof first->to_eye), 0);
  EXPECT_NEAR(at(14).turn, 2 * kPi, 1e-9);
  EXPECT_EQ(modar_screen_waiting(screen_), 0);
  modar_screen_look_around(screen_, 0, 20, 1);
  at(21);
  modar_screen_press(screen_, MODAR_TILT, 1);
  EXPECT_NEAR(at(22).turn, 2 * kPi * 37 / 64, 1e-9) << "the visitor's hand ends it";
  modar_screen_look_around(screen_, 0, 30, 0);
  EXPECT_EQ(at(32).turn, 0);
  EXPECT_EQ(modar_screen_waiting(screen_), 0);
  modar_screen_press(screen_, MODAR_TURN, 1);
  modar_screen_reset(screen_);
  EXPECT_EQ(at(33).turn, 0);
}

TEST_F(ScreenTest, FramesTellWhatIsSeen) {
  EXPECT_EQ(status().state, MODAR_STATE_START);
  EXPECT_EQ(status().pattern, 0u);
  hint(5, MODAR_REASON_FEW_MATCHES);
  EXPECT_EQ(status().state, MODAR_STATE_LOOKING);
  modar_screen_follow(screen_, 6, 2, MODAR_REASON_VISIBLE, 100);
  EXPECT_EQ(status().state, MODAR_STATE_SEEN);
  EXPECT_EQ(status().pattern, 2u);
  hint(6.8, MODAR_REASON_OUT_OF_VIEW);
  EXPECT_EQ(status().state, MODAR_STATE_LOOKING);
  EXPECT_EQ(status().pattern, 2u) << "its words stay for 0.9 seconds";
  hint(7, MODAR_REASON_OUT_OF_VIEW);
  EXPECT_EQ(status().pattern, 0u);
  modar_screen_look_around(screen_, 1, 8, 0);
  modar_screen_follow(screen_, 8, 1, MODAR_REASON_VISIBLE, 100);
  EXPECT_EQ(status().state, MODAR_STATE_AROUND) << "a late frame";
  EXPECT_EQ(status().pattern, 2u);
  modar_screen_reset(screen_);
  EXPECT_EQ(status().state, MODAR_STATE_START);
  EXPECT_EQ(status().pattern, 0u);
}

TEST_F(ScreenTest, HintsWaitUntilTheyCanBeRead) {
  EXPECT_EQ(hint(10, MODAR_REASON_LOST_BY_BLUR), MODAR_HINT_LOOK);
  EXPECT_EQ(hint(10.8, MODAR_REASON_LOST_BY_BLUR), MODAR_HINT_LOOK);
  EXPECT_EQ(hint(11, MODAR_REASON_LOST_BY_BLUR), MODAR_HINT_BLURRED);
  EXPECT_EQ(hint(11.1, MODAR_REASON_OUT_OF_VIEW), MODAR_HINT_OUTSIDE);
  EXPECT_EQ(hint(11.2, MODAR_REASON_FAILED_VERIFICATION), MODAR_HINT_HOLD);
  EXPECT_EQ(hint(11.3, MODAR_REASON_FEW_MATCHES), MODAR_HINT_LOOK);
  EXPECT_EQ(hint(11.4, MODAR_REASON_CURVED), MODAR_HINT_FLAT);
  EXPECT_EQ(hint(11.5, MODAR_REASON_TOO_SMALL), MODAR_HINT_CLOSER) << "without five seconds";
  EXPECT_EQ(hint(11.6, MODAR_REASON_TOO_DARK), MODAR_HINT_DARK);
  EXPECT_EQ(hint(11.7, MODAR_REASON_BLURRED), MODAR_HINT_BLURRED);
  EXPECT_EQ(hint(11.8, MODAR_REASON_OVEREXPOSED), MODAR_HINT_BRIGHT);
  EXPECT_EQ(hint(11.9, MODAR_REASON_GLARE), MODAR_HINT_BRIGHT);
  EXPECT_EQ(hint(12.0, MODAR_REASON_AT_THE_EDGE), MODAR_HINT_WHOLE);
  EXPECT_EQ(hint(12.1, -1), MODAR_HINT_LOOK);
  EXPECT_EQ(hint(14.9, MODAR_REASON_NOT_IN_VIEW), MODAR_HINT_LOOK);
  EXPECT_EQ(hint(15.1, MODAR_REASON_NOT_IN_VIEW), MODAR_HINT_CLOSER) << "after five seconds";
  EXPECT_EQ(hint(15.1, MODAR_REASON_ANOTHER_PRINT), MODAR_HINT_LOOK) << "not closer to that";
  EXPECT_EQ(hint(15.2, MODAR_REASON_NOT_IN_VIEW, 34), MODAR_HINT_DARK);
  EXPECT_EQ(hint(15.3, MODAR_REASON_NOT_IN_VIEW, 36), MODAR_HINT_CLOSER);
  modar_screen_follow(screen_, 16, 1, MODAR_REASON_VISIBLE, 100);
  EXPECT_EQ(hint(16.5, MODAR_REASON_LOST_BY_BLUR), MODAR_HINT_CLOSER) << "as before";
  EXPECT_EQ(hint(16.6, MODAR_REASON_LOST_BY_BLUR, 20), MODAR_HINT_DARK) << "that at once";
}

TEST_F(ScreenTest, WhatATapPlaysIsHeardUnlessTheVisitorSaidOtherwise) {
  const auto seen = sized<modar_event>();
  modar_screen_step(screen_, 0, &seen, 1);
  EXPECT_EQ(status().sound, 0) << "what begins by itself is silent";
  modar_event taps[] = {seen, seen};
  taps[1].kind = MODAR_TAP;
  taps[1].subject = 1;  // it leads to a link and a text
  modar_screen_step(screen_, 1, taps, 2);
  EXPECT_EQ(status().sound, 0);
  taps[1].subject = 2;  // it plays the voice
  ASSERT_GT(modar_screen_step(screen_, 2, taps, 2), 0u);
  EXPECT_EQ(status().sound, 1);
  modar_screen_press(screen_, MODAR_SOUND, 1);
  EXPECT_EQ(status().sound, 0);
  modar_screen_reset(screen_);
  modar_screen_step(screen_, 3, &seen, 1);
  ASSERT_GT(modar_screen_step(screen_, 4, taps, 2), 0u);
  EXPECT_EQ(status().sound, 0) << "off is off";
}

TEST_F(ScreenTest, PauseAndCaptionsAreSwitches) {
  EXPECT_EQ(status().paused, 0);
  EXPECT_EQ(status().captions, 1);
  modar_screen_press(screen_, MODAR_PAUSED, 1);
  modar_screen_press(screen_, MODAR_CAPTIONS_SHOWN, 1);
  EXPECT_EQ(status().paused, 1);
  EXPECT_EQ(status().captions, 0);
  modar_screen_reset(screen_);
  EXPECT_EQ(status().paused, 1) << "they stay";
  EXPECT_EQ(status().captions, 0);
}

TEST(Brightness, IsTheMean) {
  std::vector<std::uint8_t> gray(64 * 40, 200);
  for (std::size_t i = 0; i < 64 * 20; ++i) gray[i] = 20;
  // Rows 0, 16 and 32.
  EXPECT_NEAR(modar_brightness(gray.data(), 64, 64, 40), (20 + 20 + 200) / 3.0, 1e-9);
  EXPECT_EQ(modar_brightness(gray.data(), 64, 0, 0), 0);
}

TEST_F(ScreenTest, EventsAllocateNothing) {
  modar_item items[8] = {sized<modar_item>()};
  modar_screen_add_pattern(screen_, 0);
  const std::size_t before = test::allocation_count();
  touch(MODAR_TOUCH_DOWN, 10, 10);
  touch(MODAR_TOUCH_MOVE, 90, 90);
  touch(MODAR_TOUCH_UP, 90, 90);
  modar_screen_press(screen_, MODAR_SIZE, 1);
  modar_screen_items(screen_, 0, kStill, items, 8);
  modar_screen_items(screen_, modar_pattern_count(bundle_), kStill, items, 8);
  modar_screen_look_around(screen_, 0, 0, 1);
  at(1);
  EXPECT_EQ(test::allocation_count(), before);
}

}  // namespace
}  // namespace modar
