// Renders test patterns and views; see synthetic.hpp.
#include "synthetic.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "modar/features.hpp"

namespace modar::test {
namespace {

double radians(double degrees) {
  return degrees * CV_PI / 180.0;
}

double sample(const cv::Mat& picture, double x, double y) {
  const int x0 = static_cast<int>(std::floor(x));
  const int y0 = static_cast<int>(std::floor(y));
  const double fx = x - x0;
  const double fy = y - y0;
  const auto at = [&](int column, int row) {
    return static_cast<double>(picture.at<std::uint8_t>(std::clamp(row, 0, picture.rows - 1),
                                                        std::clamp(column, 0, picture.cols - 1)));
  };
  return (1 - fy) * ((1 - fx) * at(x0, y0) + fx * at(x0 + 1, y0)) +
         fy * ((1 - fx) * at(x0, y0 + 1) + fx * at(x0 + 1, y0 + 1));
}

}  // namespace

cv::Mat textured_picture(int width, int height, std::uint32_t seed) {
  cv::RNG random(seed);
  cv::Mat picture(height, width, CV_8UC1, cv::Scalar(128));
  const int count = width * height / 350;
  for (int i = 0; i < count; ++i) {
    const cv::Point centre(random.uniform(0, width), random.uniform(0, height));
    const double shrink = 1.0 - 0.8 * i / count;
    const int size = 2 + static_cast<int>(random.uniform(0.0, 30.0 * shrink));
    const cv::Scalar gray(random.uniform(0, 256));
    switch (random.uniform(0, 3)) {
      case 0:
        cv::circle(picture, centre, size / 2, gray, cv::FILLED, cv::LINE_AA);
        break;
      case 1:
        cv::rectangle(picture, centre, centre + cv::Point(size, random.uniform(2, 4 + size)), gray,
                      cv::FILLED);
        break;
      default:
        cv::line(
            picture, centre,
            centre + cv::Point(random.uniform(-size, size + 1), random.uniform(-size, size + 1)),
            gray, 2, cv::LINE_AA);
    }
  }
  return picture;
}

View look_at(double distance, double tilt, double tilt_axis, double roll, double x, double y) {
  // The frontal camera has the pattern's y and z axes reversed.
  const cv::Matx33d frontal(1, 0, 0, 0, -1, 0, 0, 0, -1);
  const double a = radians(tilt_axis);
  cv::Matx33d turn;
  cv::Matx33d spin;
  cv::Rodrigues(cv::Vec3d(std::cos(a), std::sin(a), 0) * radians(tilt), turn);
  cv::Rodrigues(cv::Vec3d(0, 0, radians(roll)), spin);
  return {spin * turn * frontal, {x, y, distance}};
}

cv::Mat camera_matrix(const Camera& camera) {
  return cv::Mat(cv::Matx33d(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1));
}

cv::Mat distortion(const Camera& camera) {
  return cv::Mat(std::vector<double>(camera.distortion.begin(), camera.distortion.end()), true);
}

cv::Mat render(const cv::Mat& pattern, const View& view, const Camera& camera,
               const cv::Mat& background) {
  constexpr int kSamples = 3;
  std::vector<cv::Point2d> rays;
  for (int y = 0; y < camera.height * kSamples; ++y) {
    for (int x = 0; x < camera.width * kSamples; ++x) {
      rays.emplace_back((x + 0.5) / kSamples - 0.5, (y + 0.5) / kSamples - 0.5);
    }
  }
  cv::undistortPoints(rays, rays, camera_matrix(camera), distortion(camera));
  // Ray p = s (x, y, 1) meets the plane where R^T (p - t) has z = 0.
  const cv::Matx33d back = view.rotation.t();
  const cv::Vec3d eye = back * (-view.translation);
  const double longest = std::max(pattern.cols, pattern.rows);
  cv::Mat frame(camera.height, camera.width, CV_8UC1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double sum = 0;
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const int row = y * kSamples + s / kSamples;
        const int column = x * kSamples + s % kSamples;
        const auto& ray =
            rays[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width * kSamples) +
                 static_cast<std::size_t>(column)];
        const cv::Vec3d direction = back * cv::Vec3d(ray.x, ray.y, 1);
        const double along = -eye[2] / direction[2];
        const double u = 0.5 * ((eye[0] + along * direction[0]) * longest + pattern.cols) - 0.5;
        const double v = 0.5 * (pattern.rows - (eye[1] + along * direction[1]) * longest) - 0.5;
        const bool inside = along > 0 && u >= -0.5 && v >= -0.5 && u <= pattern.cols - 0.5 &&
                            v <= pattern.rows - 0.5;
        sum += inside ? sample(pattern, u, v) : background.at<std::uint8_t>(y, x);
      }
      frame.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>(std::lround(sum / (kSamples * kSamples)));
    }
  }
  return frame;
}

std::vector<cv::Point2d> true_corners(const cv::Mat& pattern, const View& view,
                                      const Camera& camera) {
  const double longest = std::max(pattern.cols, pattern.rows);
  const double w = pattern.cols / longest;
  const double h = pattern.rows / longest;
  const std::vector<cv::Point3d> world = {{-w, h, 0}, {w, h, 0}, {w, -h, 0}, {-w, -h, 0}};
  cv::Vec3d vector;
  cv::Rodrigues(view.rotation, vector);
  std::vector<cv::Point2d> corners;
  cv::projectPoints(world, vector, view.translation, camera_matrix(camera), distortion(camera),
                    corners);
  return corners;
}

GrayImage gray(const cv::Mat& picture) {
  return {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step[0])};
}

void add_pattern(BundleContent& content, const cv::Mat& pattern, const std::string& name,
                 std::uint32_t set_id) {
  ParameterSetRecord set{};
  for (const ParameterSetRecord& each : paper_parameter_sets()) {
    if (each.id == set_id) set = each;
  }
  set.name = content.intern(parameter_set_name(set_id));
  if (content.parameter_sets.empty()) content.parameter_sets.push_back(set);
  const auto features = describe_image(gray(pattern), set);
  ASSERT_TRUE(features) << to_line(features.error());
  FeatureContent described;
  described.set_id = set_id;
  described.descriptor_bytes = features->descriptor_bytes;
  described.keypoints = features->keypoints;
  described.descriptors = features->descriptors;
  described.yml = features_to_yml(*features);
  PatternRecord record{};
  record.name = content.intern(name);
  record.width = static_cast<std::uint32_t>(pattern.cols);
  record.height = static_cast<std::uint32_t>(pattern.rows);
  const float longest = static_cast<float>(std::max(pattern.cols, pattern.rows));
  record.half_width = static_cast<float>(pattern.cols) / longest;
  record.half_height = static_cast<float>(pattern.rows) / longest;
  record.score = -1;
  content.patterns.push_back(record);
  content.features.push_back({described});
}

std::vector<std::byte> bundle_bytes(const BundleContent& content) {
  std::vector<std::byte> bytes;
  const auto written = write_bundle(content, [&](std::span<const std::byte> part) {
    bytes.insert(bytes.end(), part.begin(), part.end());
    return true;
  });
  EXPECT_TRUE(written) << to_line(written.error());
  return bytes;
}

std::string opencv_photos() {
  const std::string folder = "/usr/share/doc/opencv-doc/examples/data";
  return std::filesystem::is_directory(folder) ? folder : "";
}

}  // namespace modar::test
