// The vision thread's step on rendered frames of a camera that is known.
#include "runtime/play/vision.hpp"

#include <gtest/gtest.h>

#include "bake/pattern/pattern.hpp"
#include "tests/track/synthetic.hpp"

namespace modar {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr int kHeld = 5;  // frames of each view
constexpr int kViews = 30;

struct Film {
  GrayPicture pattern;
  std::vector<std::byte> bytes;
  Camera truth = default_camera(kWidth, kHeight);
};

const Film& film() {
  static const Film kFilm = [] {
    Film made;
    const cv::Mat image = test::textured_picture(320, 260, 12);
    made.pattern = {image.cols, image.rows, {image.datastart, image.dataend}};
    TrackerRecordOptions bake;
    bake.trial_views = 12;
    made.bytes = bundle_of_pattern(made.pattern.view(), bake).value();
    made.truth.fx = made.truth.fy = 840;  // the default would be 640
    return made;
  }();
  return kFilm;
}

/// The last job of a run over tilted views, each held for some frames, and that view's depth.
struct Played {
  Job job;
  double depth = 0;
};

Played play(const VisionOptions& options, int views) {
  const BundleView bundle = BundleView::open(film().bytes).value();
  const TrackStep track = our_vision(bundle, options);
  Random random(9);
  const GrayPicture background = made_background(kWidth, kHeight, random);
  SceneBand band;
  band.area_low = 0.8;
  band.area_high = 1.6;
  band.tilt_low = 25;
  band.tilt_high = 50;
  Played played;
  for (int view = 0; view < views; ++view) {
    const Pose pose = draw_pose(band, film().pattern.view(), film().truth, random);
    SceneFrame scene =
        render_scene(film().pattern.view(), film().truth, pose, background, band, random);
    played.depth = pose.translation.z;
    played.job.frame.width = kWidth;
    played.job.frame.height = kHeight;
    played.job.frame.gray = std::move(scene.picture.pixels);
    for (int i = 0; i < kHeld; ++i) {
      const auto done = track(played.job);
      EXPECT_TRUE(done) << to_line(done.error());
    }
  }
  return played;
}

TEST(Vision, AnUnknownFocalLengthIsEstimatedWhilePlaying) {
  const Played found = play({}, kViews);
  EXPECT_NEAR(found.job.camera.fx, film().truth.fx, 0.03 * film().truth.fx);
  EXPECT_EQ(found.job.camera.fx, found.job.camera.fy);
  ASSERT_EQ(found.job.track.visible.size(), 1u);
  EXPECT_NEAR(found.job.track.visible[0].pose.translation.z, found.depth, 0.04 * found.depth);
}

TEST(Vision, AGivenCameraStays) {
  VisionOptions options;
  options.camera = default_camera(kWidth, kHeight);
  options.camera->fx = options.camera->fy = 700;
  EXPECT_EQ(play(options, 2).job.camera.fx, 700);
}

}  // namespace
}  // namespace modar
