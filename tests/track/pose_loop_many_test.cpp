// Many patterns in one bundle: the index names the right ones at once, none is taken for another,
// and one that was hidden is soon back.
#include <gtest/gtest.h>

#include "bake/pattern/pattern.hpp"
#include "modar/pose_loop.hpp"
#include "tests/track/pose_loop_samples.hpp"

namespace modar {
namespace {

using namespace test;  // the samples

constexpr std::size_t kMany = 16;

const cv::Mat& picture_of(std::size_t i) {
  static const std::vector<cv::Mat> kPictures = [] {
    std::vector<cv::Mat> pictures;
    for (std::uint32_t k = 0; k < kMany; ++k) {
      pictures.push_back(textured_picture(120, 96, 500 + k));
    }
    return pictures;
  }();
  return kPictures[i];
}

const std::vector<std::byte>& bundle_of_many() {
  static const std::vector<std::byte> kBundle = [] {
    std::vector<std::vector<std::byte>> records;
    TrackerRecordOptions options;
    options.features = 400;
    options.jobs = 2;
    options.trial_views = 4;
    for (std::size_t i = 0; i < kMany; ++i) {
      records.push_back(make_tracker_record(gray(picture_of(i)), options).value());
    }
    return bundle_with(records);
  }();
  return kBundle;
}

const Camera& camera() {
  static const Camera kCamera = default_camera(kWidth, kHeight);
  return kCamera;
}

SceneFrame shown(std::size_t pattern, const View& view, const GrayPicture& behind) {
  Random random(11 + pattern);
  const SceneLight light;
  return render_scene(gray(picture_of(pattern)), camera(), pose_of(view), behind, SceneBand{},
                      random, &light);
}

std::unique_ptr<PoseLoop> loop_of_many(bool track) {
  PoseLoopOptions options;
  options.track = track;
  auto loop = PoseLoop::create(BundleView::open(bundle_of_many()).value(), camera(), options);
  EXPECT_TRUE(loop) << to_line(loop.error());
  return std::move(*loop);
}

// Each frame counts alone: what the index does not name has no second chance but its turn, one
// frame in sixteen.
TEST(PoseLoopMany, EachIsFoundInTheFirstFrameAndForNoOther) {
  const auto loop = loop_of_many(false);
  TrackResult result;
  int found = 0;
  for (std::size_t i = 0; i < kMany; ++i) {
    const auto turn = static_cast<double>(i);
    const View view = look_at(2.6 + 0.06 * turn, 2.0 * turn, 31 * turn, 17 * turn);
    const auto seed = static_cast<std::uint32_t>(77 + i % 4);
    const SceneFrame scene = shown(i, view, clutter(kWidth, kHeight, seed));
    ASSERT_TRUE(loop->step(scene.picture.view(), result));
    for (const Detection& each : result.visible) {
      EXPECT_EQ(each.pattern, i);
      EXPECT_LT(worst_corner(each, scene), 2.0) << i;
      ++found;
    }
  }
  EXPECT_GE(found, 15);
}

TEST(PoseLoopMany, SeveralAtOnceAreAllFoundAndOneIsSoonBack) {
  const auto loop = loop_of_many(true);
  constexpr std::size_t kShown[] = {3, 8, 11, 15};
  const auto frame = [&](int time, bool all) {
    GrayPicture picture = clutter(kWidth, kHeight, 77);
    for (std::size_t k = all ? 0 : 1; k < 4; ++k) {
      const double x = k % 2 == 0 ? -1.3 : 1.3;
      const double y = k < 2 ? -0.95 : 0.95;
      const View view = look_at(5.0, 10, 40.0 * static_cast<double>(k), 0.5 * time, x, y);
      picture = shown(kShown[k], view, picture).picture;
    }
    return picture;
  };
  TrackResult result;
  for (int time = 0; time < 5; ++time) ASSERT_TRUE(loop->step(frame(time, true).view(), result));
  ASSERT_EQ(result.visible.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(result.visible[k].pattern, kShown[k]);
  for (int time = 5; time < 12; ++time) ASSERT_TRUE(loop->step(frame(time, false).view(), result));
  EXPECT_EQ(result.visible.size(), 3u);
  int waited = 0;
  while (waited < 5 && result.visible.size() != 4) {
    ASSERT_TRUE(loop->step(frame(12 + waited, true).view(), result));
    ++waited;
  }
  EXPECT_LE(waited, 3);
}

}  // namespace
}  // namespace modar
