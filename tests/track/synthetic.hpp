// Pictures of our own making for the tracking tests: textured patterns, and views of them rendered
// from known poses by code that shares nothing with the code under test.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "formats/bundle_writer.hpp"
#include "modar/camera.hpp"
#include "modar/image.hpp"

namespace modar::test {

/// A gray picture of random discs, bars and letters-like strokes on several scales.
cv::Mat textured_picture(int width, int height, std::uint32_t seed);

/// A camera pose by a rotation matrix (row by row) and a translation, in pattern units.
struct View {
  cv::Matx33d rotation;
  cv::Vec3d translation;
};

/// Looks at the pattern's centre from `distance`, tilted about an axis in the plane, then rolled.
/// Angles in degrees; tilt 0 and roll 0 is the frontal view.
View look_at(double distance, double tilt, double tilt_axis, double roll, double x = 0,
             double y = 0);

/// Renders `pattern` as seen with `camera` (its distortion included) over `background`.
cv::Mat render(const cv::Mat& pattern, const View& view, const Camera& camera,
               const cv::Mat& background);

/// The four corners of the pattern in the frame, by cv::projectPoints.
std::vector<cv::Point2d> true_corners(const cv::Mat& pattern, const View& view,
                                      const Camera& camera);

cv::Mat camera_matrix(const Camera& camera);
cv::Mat distortion(const Camera& camera);
GrayImage gray(const cv::Mat& picture);

/// Adds a pattern described under parameter set `set_id` to the content.
void add_pattern(BundleContent& content, const cv::Mat& pattern, const std::string& name,
                 std::uint32_t set_id);
/// Writes the content; fails the test where that fails.
std::vector<std::byte> bundle_bytes(const BundleContent& content);

/// The folder of the photos of Debian's package opencv-doc; empty if it is not installed.
std::string opencv_photos();

}  // namespace modar::test
