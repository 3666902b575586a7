// Many patterns in one bundle: the index names the right ones at once, none is taken for another,
// and one that was hidden is soon back.
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/pattern.hpp"
#include "modar/pose_loop.hpp"
#include "tests/track/pose_loop_samples.hpp"

namespace modar {
namespace {

using namespace test;  // the samples

constexpr std::size_t kMany = 24;

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

std::unique_ptr<PoseLoop> loop_of_many(bool track, const Camera& seen_by = camera()) {
  PoseLoopOptions options;
  options.track = track;
  auto loop = PoseLoop::create(BundleView::open(bundle_of_many()).value(), seen_by, options);
  EXPECT_TRUE(loop) << to_line(loop.error());
  return std::move(*loop);
}

// Each frame counts alone: what the index does not name has no second chance.
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
  EXPECT_GE(found, 23);
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

// A search ends at its first find, and the next frame is searched again.
TEST(PoseLoopMany, TwentyAreTrackedAtOnce) {
  constexpr int kShown = 20;
  constexpr int kColumns = 5;
  const cv::Size cell(192, 180);
  const cv::Size size(168, 134);
  const Camera wide = default_camera(kColumns * cell.width, 4 * cell.height);
  GrayPicture picture = plain(wide.width, wide.height, 128);
  cv::Mat frame(wide.height, wide.width, CV_8U, picture.pixels.data());
  const auto corner_of = [&](int k) {
    return cv::Point(k % kColumns * cell.width + 11, k / kColumns * cell.height + 23);
  };
  for (int k = 0; k < kShown; ++k) {
    cv::resize(picture_of(static_cast<std::size_t>(k)), frame(cv::Rect(corner_of(k), size)), size);
  }
  const auto loop = loop_of_many(true, wide);
  TrackResult result;
  for (int time = 0; time < kShown + 2; ++time) ASSERT_TRUE(loop->step(picture.view(), result));
  ASSERT_EQ(result.visible.size(), std::size_t{kShown});
  for (int k = 0; k < kShown; ++k) {
    const Detection& seen = result.visible[static_cast<std::size_t>(k)];
    EXPECT_EQ(seen.pattern, static_cast<std::uint32_t>(k));
    EXPECT_NEAR(seen.corners[0].x, corner_of(k).x - 0.5, 1.0);
    EXPECT_NEAR(seen.corners[0].y, corner_of(k).y - 0.5, 1.0);
  }
}

TEST(PoseLoopMany, NoneIsNamedWhereNoneIs) {
  const auto loop = loop_of_many(false);
  TrackResult result;
  for (std::uint32_t i = 0; i < 20; ++i) {
    ASSERT_TRUE(loop->step(clutter(kWidth, kHeight, 200 + i).view(), result));
    EXPECT_TRUE(result.visible.empty()) << i;
  }
}

}  // namespace
}  // namespace modar
