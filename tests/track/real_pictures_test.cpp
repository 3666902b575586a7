// The article's tracker on a photo of the package opencv-doc.
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "modar/paper_tracker.hpp"
#include "synthetic.hpp"

namespace modar {
namespace {

std::vector<std::byte> bundle_of(const cv::Mat& pattern) {
  BundleContent content;
  test::add_pattern(content, pattern, "pattern", 1);
  return test::bundle_bytes(content);
}

TEST(RealPictures, TheBoxIsRecognisedInItsScene) {
  const std::string data = test::opencv_photos();
  if (data.empty()) GTEST_SKIP() << "opencv-doc is not installed";
  const cv::Mat box = cv::imread(data + "/box.png", cv::IMREAD_GRAYSCALE);
  const cv::Mat scene = cv::imread(data + "/box_in_scene.png", cv::IMREAD_GRAYSCALE);
  ASSERT_FALSE(box.empty() || scene.empty());
  const auto bytes = bundle_of(box);
  auto tracker = PaperTracker::create(BundleView::open(bytes).value(), 1,
                                      default_camera(scene.cols, scene.rows));
  ASSERT_TRUE(tracker);
  const auto result = (*tracker)->step(test::gray(scene));
  ASSERT_TRUE(result);
  ASSERT_EQ(result->visible.size(), 1u) << to_string(result->reason);
  // Read off the picture by eye.
  EXPECT_NEAR(result->visible[0].corners[0].x, 118, 12);
  EXPECT_NEAR(result->visible[0].corners[0].y, 160, 12);
}

}  // namespace
}  // namespace modar
