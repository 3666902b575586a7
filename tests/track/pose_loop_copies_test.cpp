// Several copies of one print in a frame: each has its own pose and keeps its number, also where
// one covers another, and there are no more than the frame shows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bake/pattern/pattern.hpp"
#include "modar/modar.h"
#include "modar/pose_loop.hpp"
#include "tests/track/pose_loop_samples.hpp"

namespace modar {
namespace {

using namespace test;  // the samples

constexpr int kMost = 8;

const std::vector<std::byte>& bundle_of_one() {
  static const std::vector<std::byte> kBundle = bundle_with({record()});
  return kBundle;
}

std::unique_ptr<PoseLoop> loop_of(int copies, int budget = 0, bool async = false) {
  PoseLoopOptions options;
  options.max_instances = copies;
  options.budget = budget;
  options.async_search = async;
  auto loop = PoseLoop::create(BundleView::open(bundle_of_one()).value(),
                               default_camera(kWidth, kHeight), options);
  EXPECT_TRUE(loop) << to_line(loop.error());
  return std::move(*loop);
}

/// A frame of these views, later ones before earlier ones, and where each has its corners.
struct CopiesFrame {
  GrayPicture picture = clutter(kWidth, kHeight, 77);
  std::vector<SceneFrame> copies;

  explicit CopiesFrame(std::span<const View> views) {
    for (const View& view : views) {
      copies.push_back(frame_of(view, picture));
      picture = copies.back().picture;
    }
  }
  /// The copy nearest to a detection.
  [[nodiscard]] int at(const Detection& detection) const {
    const auto nearest = std::min_element(
        copies.begin(), copies.end(), [&](const SceneFrame& a, const SceneFrame& b) {
          return worst_corner(detection, a) < worst_corner(detection, b);
        });
    return static_cast<int>(nearest - copies.begin());
  }
};

/// Copy `i` of eight in rows of four, each turned otherwise.
View place_of(int i, int time) {
  const double x = -3.0 + 2.0 * (i % 4);
  const double y = i < 4 ? -1.3 : 1.3;
  return look_at(8.0, 12, 40.0 * i, 10.0 * i + 0.5 * time, x, y);
}

std::vector<View> places(int count, int time) {
  std::vector<View> views;
  for (int i = 0; i < count; ++i) views.push_back(place_of(i, time));
  return views;
}

class PoseLoopCopies : public testing::TestWithParam<int> {};

TEST_P(PoseLoopCopies, AllAreFoundWithinTenFramesAndKeepTheirNumbers) {
  const int count = GetParam();
  const auto loop = loop_of(kMost);
  TrackResult result;
  std::array<int, kMost> of{};
  for (int time = 0; time < 15; ++time) {
    const CopiesFrame frame(places(count, time));
    ASSERT_TRUE(loop->step(frame.picture.view(), result));
    EXPECT_EQ(result.crowded, -1);
    std::array<bool, kMost> taken{};
    for (const Detection& each : result.visible) {
      const int copy = frame.at(each);
      EXPECT_LT(worst_corner(each, frame.copies[static_cast<std::size_t>(copy)]), 2.0) << time;
      EXPECT_FALSE(std::exchange(taken[static_cast<std::size_t>(copy)], true)) << time;
      if (time == 10) of[each.copy] = copy;
      if (time > 10) {
        EXPECT_EQ(of[each.copy], copy) << time;
      }
    }
    if (time >= 9) {
      ASSERT_EQ(result.visible.size(), static_cast<std::size_t>(count)) << time;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Counts, PoseLoopCopies, testing::Values(1, 2, kMost));

// One passes before the other, from left to right, and covers it for some 10 frames.
TEST(PoseLoopCopiesMoving, TheNumbersSurviveACrossing) {
  for (const int budget : {0, 20}) {
    const auto loop = loop_of(2, budget);
    TrackResult result;
    std::array<int, 2> of{-1, -1};
    int right = 0;
    constexpr int kFrames = 55;
    for (int time = 0; time < kFrames; ++time) {
      const double x = -2.2 + 0.1 * std::clamp(time - 10, 0, 40);
      const View views[] = {look_at(5.5, 5, 20, 4, 0.1, 0.05), look_at(4.6, 8, 70, -6, x, -0.1)};
      const CopiesFrame frame(views);
      ASSERT_TRUE(loop->step(frame.picture.view(), result));
      for (const Detection& each : result.visible) {
        const int copy = frame.at(each);
        if (time == 9) of[each.copy] = copy;
        if (time > 9) {
          EXPECT_EQ(copy, of[each.copy]) << time;
        }
        right += time > 9 && worst_corner(each, frame.copies[static_cast<std::size_t>(copy)]) < 3;
      }
      if (time == 9 || time == kFrames - 1) {
        EXPECT_EQ(result.visible.size(), 2u) << time;
      }
    }
    EXPECT_GE(right, 45 + 25) << budget;
  }
}

// A track whose copy is covered is drawn to the other copy, and ends there.
TEST(PoseLoopCopiesMoving, NoneIsShownTwice) {
  const auto loop = loop_of(2);
  TrackResult result;
  std::array<int, 2> seen{};
  for (int time = 0; time < 60; ++time) {
    const double turn = 0.1 * std::max(0, time - 15);
    std::vector<View> views;
    for (int i = 0; i < 2; ++i) {
      const double across = 1.3 * i + 7;
      const double down = 2.1 * i + 14;
      views.push_back(look_at(8.0 + 1.2 * std::sin(0.6 * turn + i) - 0.3 * i, 15,
                              40.0 * i + 10 * turn, 12.0 * i + 20 * std::sin(0.5 * turn + i),
                              -2.6 + 1.75 * i + 1.6 * (std::sin(turn + across) - std::sin(across)),
                              -1.2 + 1.3 * (std::sin(1.3 * turn + down) - std::sin(down))));
    }
    const CopiesFrame frame(views);
    ASSERT_TRUE(loop->step(frame.picture.view(), result));
    std::array<bool, 2> taken{};
    for (const Detection& each : result.visible) {
      const auto copy = static_cast<std::size_t>(frame.at(each));
      EXPECT_FALSE(std::exchange(taken[copy], true)) << time;
      ++seen[copy];
    }
  }
  EXPECT_GE(seen[0] + seen[1], 80);
}

TEST(PoseLoopCopiesMoving, CopiesThatComeBackHaveTheirNumbers) {
  const auto loop = loop_of(3);
  TrackResult result;
  const View small = look_at(8.0, 20, 40, 10, -2.2, 1.0);
  const View large = look_at(4.5, 5, 20, 0, 0.8, 0.1);
  const std::vector<View> of_time[] = {{small}, {small, large}, {}, {small, large}};
  for (int time = 0; time < 40; ++time) {
    const CopiesFrame frame(of_time[time / 10]);
    ASSERT_TRUE(loop->step(frame.picture.view(), result));
    if (time % 10 != 9) continue;
    ASSERT_EQ(result.visible.size(), frame.copies.size()) << time;
    for (const Detection& each : result.visible) {
      EXPECT_LT(worst_corner(each, frame.copies[each.copy]), 2.0) << time;
    }
  }
}

TEST(PoseLoopCopiesMoving, EachPatternHasAsManyAsTheBundleStates) {
  const auto view = [](const std::vector<std::byte>& bytes) {
    return BundleView::open(bytes).value();
  };
  const auto stated = bundle_with({record()}, 3);
  EXPECT_EQ(most_copies(view(stated), 0), 3u);
  EXPECT_EQ(most_copies(view(stated), 2), 2u);
  EXPECT_EQ(most_copies(view(stated), 99), kMaxCopies);
  EXPECT_EQ(most_copies(view(bundle_of_one()), 0), 1u);
  EXPECT_EQ(copies_of(view(stated), 0, 0), 3u);
  EXPECT_EQ(copies_of(view(stated), 1, 0), 1u) << "of the user's own picture";
}

TEST(PoseLoopCopiesMoving, OneMoreThanMayBeTrackedIsReported) {
  for (const int copies : {1, 2}) {
    const auto loop = loop_of(copies);
    TrackResult result;
    ASSERT_TRUE(loop->step(CopiesFrame(places(copies, 0)).picture.view(), result));
    EXPECT_EQ(result.crowded, -1);
    loop->reset();
    ASSERT_TRUE(loop->step(CopiesFrame(places(copies + 1, 0)).picture.view(), result));
    EXPECT_EQ(result.crowded, 0) << copies;
    EXPECT_EQ(result.visible.size(), static_cast<std::size_t>(copies));
  }
}

TEST(PoseLoopCopiesMoving, TheCApiTellsThePoseOfEachCopy) {
  auto camera = sized<modar_camera>();
  modar_camera_default(kWidth, kHeight, &camera);
  const CopiesFrame frame(places(3, 0));
  // What the app wants, else what the bundle states, at most.
  for (const auto& [asked, stated] :
       {std::pair{0, 0}, std::pair{0, 2}, std::pair{2, 0}, std::pair{4, 2}, std::pair{1, 4}}) {
    const int most = asked > 0 ? asked : std::max(1, stated);
    const auto bytes = bundle_with({record()}, static_cast<std::uint32_t>(stated));
    modar_bundle* const bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), nullptr);
    auto options = sized<modar_tracker_options>();
    options.max_instances = asked;
    modar_tracker* const tracker = modar_tracker_create(bundle, &camera, &options, nullptr);
    for (int time = 0; time < 2; ++time) {
      ASSERT_EQ(modar_tracker_step(tracker, frame.picture.pixels.data(), kWidth, -1, nullptr), 0);
      if (time == 0) {
        EXPECT_EQ(modar_tracker_crowded(tracker), most < 3 ? 0 : -1);
      }
    }
    int shown = 0;
    for (std::uint32_t copy = 0; copy < 5; ++copy) {
      auto pose = sized<modar_pose>();
      if (modar_tracker_copy(tracker, 0, copy, &pose) == 0) continue;
      shown += pose.shown;
      auto first = sized<modar_pose>();
      modar_tracker_pose(tracker, 0, &first);
      EXPECT_EQ(first.corners[0] == pose.corners[0], copy == 0);
    }
    EXPECT_EQ(shown, std::min(most, 3));
    EXPECT_EQ(modar_tracker_copy(tracker, 1, 0, nullptr), 0);
    EXPECT_EQ(modar_pattern_copies(bundle, 0), static_cast<std::uint32_t>(std::max(1, stated)));
    EXPECT_EQ(modar_pattern_copies(bundle, 1), 1u);
    modar_tracker_destroy(tracker);
    modar_bundle_close(bundle);
  }
  EXPECT_EQ(modar_tracker_copy(nullptr, 0, 0, nullptr), 0);
  EXPECT_EQ(modar_pattern_copies(nullptr, 0), 1u);
  EXPECT_EQ(modar_tracker_crowded(nullptr), -1);
}

}  // namespace
}  // namespace modar
