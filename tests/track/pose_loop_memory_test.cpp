// What the loop allocates: little to be ready, whatever the number of patterns, and nothing per
// frame.
#include <gtest/gtest.h>

#include "modar/pose_loop.hpp"
#include "tests/formats/allocation_counter.hpp"
#include "tests/track/pose_loop_samples.hpp"

namespace modar {
namespace {

using namespace test;  // the samples

TEST(TrackerMemory, NothingIsAllocatedPerFrameAfterWarmUp) {
  const auto bundle = bundle_with(std::vector(6, record()));
  auto loop = PoseLoop::create(BundleView::open(bundle).value(), default_camera(640, 480)).value();
  const GrayPicture background = clutter(640, 480, 77);
  std::vector<SceneFrame> scenes;
  for (int i = 0; i < 4; ++i) {
    scenes.push_back(frame_of(look_at(2.6, 15, 20, 10 + 2.0 * i), background));
  }
  const GrayPicture blank = plain(640, 480, 9);
  TrackResult result;
  // Searching, holding, losing, searching in vain and finding again, with all patterns in sight.
  std::size_t before = 0;
  int visible = 0;
  for (int round = 0; round < 3; ++round) {
    if (round == 1) before = allocation_count();
    for (const SceneFrame& scene : scenes) {
      ASSERT_TRUE(loop->step(scene.picture.view(), result));
      visible += result.visible.empty() ? 0 : 1;
    }
    ASSERT_TRUE(loop->step(background.view(), result));
    ASSERT_TRUE(loop->step(blank.view(), result));
  }
  EXPECT_EQ(allocation_count(), before);
  EXPECT_GE(visible, 9);
}

std::size_t allocations_to_be_ready(std::size_t patterns) {
  const auto bundle = bundle_with(std::vector(patterns, record()));
  const BundleView view = BundleView::open(bundle).value();
  const std::size_t before = allocation_count();
  const auto loop = PoseLoop::create(view, default_camera(640, 480));
  EXPECT_TRUE(loop);
  return allocation_count() - before;
}

// The records stay where they are mapped: fifty cost no more allocations than one, but for the
// growth of a few tables.
TEST(TrackerMemory, FiftyPatternsAreReadyWithoutBeingRead) {
  const std::size_t one = allocations_to_be_ready(1);
  EXPECT_LE(allocations_to_be_ready(50), one + 16);
}

}  // namespace
}  // namespace modar
