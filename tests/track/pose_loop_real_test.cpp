// The pose loop on photos and videos of others: those of the package opencv-doc.
#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "modar/pose_loop.hpp"
#include "tests/track/pose_loop_samples.hpp"
#include "tests/track/synthetic.hpp"

namespace modar {
namespace {

cv::Mat read(const std::string& path) {
  cv::Mat picture = cv::imread(path, cv::IMREAD_GRAYSCALE);
  EXPECT_FALSE(picture.empty()) << path;
  return picture;
}

/// Looks for a pattern in single frames of one size.
struct Finder {
  std::vector<std::byte> bytes;
  std::unique_ptr<PoseLoop> loop;

  Finder(const cv::Mat& pattern, cv::Size frame)
      : bytes(test::bundle_with({test::record_of(pattern)})) {
    PoseLoopOptions options;
    options.track = false;
    loop = PoseLoop::create(BundleView::open(bytes).value(),
                            default_camera(frame.width, frame.height), options)
               .value();
  }
  TrackResult look(const cv::Mat& frame) const { return loop->step(test::gray(frame)).value(); }
};

/// A pattern's outer corners in the frame, by a homography between pixel centres.
std::array<glm::dvec2, 4> corners_by(const cv::Matx33d& homography, const cv::Mat& pattern) {
  const double right = pattern.cols - 0.5;
  const double bottom = pattern.rows - 0.5;
  const std::array<cv::Vec3d, 4> corners = {cv::Vec3d(-0.5, -0.5, 1), cv::Vec3d(right, -0.5, 1),
                                            cv::Vec3d(right, bottom, 1),
                                            cv::Vec3d(-0.5, bottom, 1)};
  std::array<glm::dvec2, 4> out;
  for (std::size_t i = 0; i < 4; ++i) {
    const cv::Vec3d p = homography * corners[i];
    out[i] = {p[0] / p[2], p[1] / p[2]};
  }
  return out;
}

/// Where OpenCV's SIFT and RANSAC see the pattern.
cv::Matx33d by_sift(const cv::Mat& pattern, const cv::Mat& frame) {
  const auto sift = cv::SIFT::create();
  std::array<std::vector<cv::KeyPoint>, 2> points;
  std::array<cv::Mat, 2> codes;
  sift->detectAndCompute(pattern, cv::noArray(), points[0], codes[0]);
  sift->detectAndCompute(frame, cv::noArray(), points[1], codes[1]);
  std::vector<std::vector<cv::DMatch>> pairs;
  cv::BFMatcher(cv::NORM_L2).knnMatch(codes[0], codes[1], pairs, 2);
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> to;
  for (const auto& pair : pairs) {
    if (pair.size() < 2 || pair[0].distance > 0.75f * pair[1].distance) continue;
    from.push_back(points[0][static_cast<std::size_t>(pair[0].queryIdx)].pt);
    to.push_back(points[1][static_cast<std::size_t>(pair[0].trainIdx)].pt);
  }
  return cv::Matx33d(cv::findHomography(from, to, cv::RANSAC, 2.0));
}

void expect_near(const Detection& detection, const std::array<glm::dvec2, 4>& truth,
                 double pixels) {
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(detection.corners[i].x, truth[i].x, pixels) << "corner " << i;
    EXPECT_NEAR(detection.corners[i].y, truth[i].y, pixels) << "corner " << i;
  }
}

// A painted wall, turned by some 40 degrees: the truth came with the photos.
TEST(PoseLoopOnPhotos, FindsTheGraffitiFromTheSide) {
  const std::string data = test::opencv_photos();
  if (data.empty()) GTEST_SKIP() << "opencv-doc is not installed";
  const cv::Mat pattern = read(data + "/graf1.png");
  const cv::Mat frame = read(data + "/graf3.png");
  cv::Mat truth;
  cv::FileStorage(data + "/H1to3p.xml", cv::FileStorage::READ)["H13"] >> truth;
  const Finder finder(pattern, frame.size());
  const TrackResult result = finder.look(frame);
  ASSERT_EQ(result.visible.size(), 1u) << to_string(result.reason);
  expect_near(result.visible[0], corners_by(cv::Matx33d(truth), pattern), 5);
}

TEST(PoseLoopOnPhotos, FindsTheBoxAmongOtherThings) {
  const std::string data = test::opencv_photos();
  if (data.empty()) GTEST_SKIP() << "opencv-doc is not installed";
  const cv::Mat pattern = read(data + "/box.png");
  const cv::Mat frame = read(data + "/box_in_scene.png");
  const Finder finder(pattern, frame.size());
  const TrackResult result = finder.look(frame);
  ASSERT_EQ(result.visible.size(), 1u) << to_string(result.reason);
  expect_near(result.visible[0], corners_by(by_sift(pattern, frame), pattern), 5);
}

TEST(PoseLoopOnPhotos, SeesNothingInAVideoWithoutThePattern) {
  const std::string data = test::opencv_photos();
  if (data.empty()) GTEST_SKIP() << "opencv-doc is not installed";
  cv::VideoCapture video(data + "/tree.avi");
  ASSERT_TRUE(video.isOpened());
  cv::Mat colour;
  ASSERT_TRUE(video.read(colour));
  const Finder finder(read(data + "/box.png"), colour.size());
  int frames = 0;
  do {
    cv::Mat frame;
    cv::cvtColor(colour, frame, cv::COLOR_BGR2GRAY);
    EXPECT_TRUE(finder.look(frame).visible.empty()) << "frame " << frames;
    ++frames;
  } while (frames < 30 && video.read(colour));
  EXPECT_EQ(frames, 30);
}

}  // namespace
}  // namespace modar
