// The article's tracker on rendered views of known pose, and on frames that hold nothing.
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "modar/features.hpp"
#include "modar/paper_tracker.hpp"
#include "synthetic.hpp"

namespace modar {
namespace {

/// A bundle in memory and a tracker on it.
struct Stage {
  std::vector<cv::Mat> patterns;
  std::vector<std::byte> bytes;
  Camera camera;
  std::unique_ptr<PaperTracker> tracker;

  Stage(std::vector<cv::Mat> pictures, const Camera& with, std::uint32_t set_id = 1)
      : patterns(std::move(pictures)), camera(with) {
    BundleContent content;
    for (std::size_t i = 0; i < patterns.size(); ++i) {
      test::add_pattern(content, patterns[i], "p" + std::to_string(i), set_id);
    }
    bytes = test::bundle_bytes(content);
    const auto bundle = BundleView::open(bytes);
    EXPECT_TRUE(bundle) << to_line(bundle.error());
    auto made = PaperTracker::create(*bundle, set_id, camera);
    EXPECT_TRUE(made) << to_line(made.error());
    tracker = std::move(*made);
  }
};

Camera small_camera() {
  return default_camera(480, 360);
}

double corner_error(const Detection& detection, const std::vector<cv::Point2d>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    sum += std::hypot(detection.corners[i].x - truth[i].x, detection.corners[i].y - truth[i].y);
  }
  return sum / 4;
}

void expect_pose_of_solve_pnp(const Detection& detection, const cv::Mat& pattern,
                              const Camera& camera) {
  const double longest = std::max(pattern.cols, pattern.rows);
  const double w = pattern.cols / longest;
  const double h = pattern.rows / longest;
  const std::vector<cv::Point3d> world = {{-w, h, 0}, {w, h, 0}, {w, -h, 0}, {-w, -h, 0}};
  std::vector<cv::Point2d> pixels;
  for (const glm::dvec2& corner : detection.corners) pixels.emplace_back(corner.x, corner.y);
  // An ideal pinhole's pixels by OpenCV: then both minimise the same distances.
  const cv::Mat k = test::camera_matrix(camera);
  cv::undistortPoints(
      pixels, pixels, k, test::distortion(camera), cv::noArray(), k,
      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-12));
  cv::Vec3d vector;
  cv::Vec3d translation;
  cv::solvePnP(world, pixels, k, cv::noArray(), vector, translation, false, cv::SOLVEPNP_ITERATIVE);
  cv::Mat rotation;
  cv::Rodrigues(vector, rotation);
  for (int row = 0; row < 3; ++row) {
    EXPECT_NEAR(detection.pose.translation[row], translation[row], 1e-3);
    for (int column = 0; column < 3; ++column) {
      EXPECT_NEAR(detection.pose.rotation[column][row], rotation.at<double>(row, column), 1e-3);
    }
  }
}

TEST(PaperTracker, FindsRenderedViewsWhereTheyAre) {
  Camera camera = small_camera();
  // Mild: the article fits its homography before it undistorts, so a strong lens moves its corners.
  camera.distortion = {-0.03, 0.01, 0.0005, -0.0005, 0};
  const cv::Mat pattern = test::textured_picture(300, 245, 21);
  const cv::Mat background = test::textured_picture(480, 360, 99) / 4 + 96;
  for (const std::uint32_t set_id : {1u, 2u, 3u, 4u}) {
    Stage stage({pattern}, camera, set_id);
    const std::vector<test::View> views = {test::look_at(2.6, 0, 0, 0),
                                           test::look_at(3.0, 25, 40, 70),
                                           test::look_at(3.2, 30, 130, -160, 0.1, 0.1)};
    for (std::size_t i = 0; i < views.size(); ++i) {
      const cv::Mat frame = test::render(pattern, views[i], camera, background);
      const auto result = stage.tracker->step(test::gray(frame));
      ASSERT_TRUE(result) << to_line(result.error());
      ASSERT_EQ(result->visible.size(), 1u)
          << "set " << set_id << " view " << i << ": " << to_string(result->reason);
      EXPECT_EQ(result->reason, Reason::kVisible);
      const Detection& detection = result->visible[0];
      EXPECT_LT(corner_error(detection, test::true_corners(pattern, views[i], camera)), 2.5);
      EXPECT_GE(detection.matches, detection.inliers);
      EXPECT_GE(detection.inliers, 8);
      expect_pose_of_solve_pnp(detection, pattern, camera);
      EXPECT_NEAR(detection.pose.translation.z, views[i].translation[2],
                  0.05 * views[i].translation[2]);
    }
  }
}

// With BRISK: ORB at eight inliers "recognises" absent patterns, which the article leaves so.
TEST(PaperTracker, TellsPatternsApartAndGivesTheSameAnswerTwice) {
  const Camera camera = small_camera();
  const cv::Mat first = test::textured_picture(300, 245, 21);
  const cv::Mat second = test::textured_picture(250, 294, 22);
  Stage stage({first, second}, camera, 3);
  const cv::Mat gray(360, 480, CV_8UC1, cv::Scalar(120));
  const cv::Mat frame = test::render(second, test::look_at(2.8, 20, 10, 30), camera, gray);
  const auto once = stage.tracker->step(test::gray(frame));
  const auto twice = stage.tracker->step(test::gray(frame));
  ASSERT_TRUE(once && twice);
  ASSERT_EQ(once->visible.size(), 1u);
  EXPECT_EQ(once->visible[0].pattern, 1u);
  ASSERT_EQ(twice->visible.size(), 1u);
  EXPECT_EQ(once->visible[0].corners, twice->visible[0].corners);
  EXPECT_EQ(once->visible[0].pose.translation, twice->visible[0].pose.translation);
}

TEST(PaperTracker, SaysWhyNothingIsVisible) {
  const Camera camera = small_camera();
  Stage stage({test::textured_picture(300, 245, 21)}, camera);
  const cv::Mat blank(360, 480, CV_8UC1, cv::Scalar(120));
  EXPECT_EQ(stage.tracker->step(test::gray(blank))->reason, Reason::kNoFeatures);
  // A few corners: features, but hardly a match.
  cv::Mat sparse = blank.clone();
  cv::rectangle(sparse, {200, 150}, {215, 170}, cv::Scalar(10), cv::FILLED);
  const auto few = stage.tracker->step(test::gray(sparse));
  EXPECT_EQ(few->reason, Reason::kFewMatches);
  EXPECT_GT(few->features, 0);
  EXPECT_TRUE(few->visible.empty());
}

TEST(PaperTracker, FramesOfAnyContentAndSizeDoNoHarm) {
  for (const cv::Size& size : {cv::Size(1, 1), {2, 900}, {63, 63}, {64, 64}, {211, 97}}) {
    Stage stage({test::textured_picture(160, 120, 4)}, default_camera(size.width, size.height));
    cv::Mat noise(size, CV_8UC1);
    cv::RNG random(5);
    random.fill(noise, cv::RNG::UNIFORM, 0, 256);
    EXPECT_TRUE(stage.tracker->step(test::gray(noise)));
    EXPECT_TRUE(stage.tracker->step(test::gray(cv::Mat::zeros(size, CV_8UC1))));
  }
}

TEST(PaperTracker, RefusesFramesOfAnotherSizeThanItsCamera) {
  Stage stage({test::textured_picture(160, 120, 4)}, small_camera());
  const cv::Mat other(480, 640, CV_8UC1, cv::Scalar(0));
  const auto result = stage.tracker->step(test::gray(other));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, "tracker.frame-size");
  EXPECT_FALSE(stage.tracker->step({}));
}

TEST(PaperTracker, ABundleWithoutPatternsOrWithoutTheSetIsAnError) {
  const auto empty = test::bundle_bytes(BundleContent{});
  const auto none = PaperTracker::create(BundleView::open(empty).value(), 1, small_camera());
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, "tracker.no-patterns");
  BundleContent content;
  test::add_pattern(content, test::textured_picture(160, 120, 4), "p", 2);
  const auto bytes = test::bundle_bytes(content);
  EXPECT_FALSE(PaperTracker::create(BundleView::open(bytes).value(), 1, small_camera()));
}

}  // namespace
}  // namespace modar
