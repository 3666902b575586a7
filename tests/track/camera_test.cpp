// Camera model against OpenCV's projection and undistortion, GL's matrix against a numeric one.
#include "modar/camera.hpp"

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "synthetic.hpp"

namespace modar {
namespace {

Camera lens() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 535.9;
  camera.fy = 531.2;
  camera.cx = 342.3;
  camera.cy = 235.6;
  camera.distortion = {-0.266, 0.0386, 0.00178, -0.00028, 0.0238};
  return camera;
}

TEST(Camera, DefaultHasTheWidthAsFocalLengthAndTheCentreAsPrincipalPoint) {
  const Camera camera = default_camera(1280, 720);
  EXPECT_EQ(camera.width, 1280);
  EXPECT_EQ(camera.height, 720);
  EXPECT_EQ(camera.fx, 1280.0);
  EXPECT_EQ(camera.fy, 1280.0);
  EXPECT_EQ(camera.cx, 639.5);
  EXPECT_EQ(camera.cy, 359.5);
}

TEST(Camera, ProjectsAsOpenCv) {
  const Camera camera = lens();
  const std::vector<cv::Point3d> points = {
      {0, 0, 1}, {0.3, -0.2, 1.1}, {-0.5, 0.4, 0.9}, {2, 1, 7}};
  std::vector<cv::Point2d> expected;
  cv::projectPoints(points, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), test::camera_matrix(camera),
                    test::distortion(camera), expected);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec2 seen = project(camera, {points[i].x, points[i].y, points[i].z});
    EXPECT_NEAR(seen.x, expected[i].x, 1e-9);
    EXPECT_NEAR(seen.y, expected[i].y, 1e-9);
  }
}

TEST(Camera, UndistortsAsOpenCv) {
  const Camera camera = lens();
  for (int y = 0; y < camera.height; y += 60) {
    for (int x = 0; x < camera.width; x += 80) {
      std::vector<cv::Point2d> points = {{static_cast<double>(x), static_cast<double>(y)}};
      const cv::Mat k = test::camera_matrix(camera);
      cv::undistortPoints(
          points, points, k, test::distortion(camera), cv::noArray(), k,
          cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-12));
      const glm::dvec2 ideal = undistort(camera, {x, y});
      EXPECT_NEAR(ideal.x, points[0].x, 1e-5);
      EXPECT_NEAR(ideal.y, points[0].y, 1e-5);
    }
  }
}

TEST(Camera, UndistortAnswersAFinitePixelBeyondTheLensModel) {
  Camera camera = lens();
  camera.distortion = {-0.9, 0, 0, 0, 0};
  const glm::dvec2 ideal = undistort(camera, {5000, 4000});
  EXPECT_TRUE(std::isfinite(ideal.x) && std::isfinite(ideal.y));
}

// A pixel of the small frame and the pixel of the large one that shows the same direction.
TEST(Camera, ScaledCameraSeesTheSameDirections) {
  Camera large = default_camera(1280, 720);
  large.fx = 1100;
  large.fy = 1090;
  large.cx = 650;
  large.cy = 350;
  const Camera half = scaled_camera(large, 640, 360);
  const glm::dvec3 point{0.2, -0.1, 1.0};
  const glm::dvec2 in_large = project(large, point);
  const glm::dvec2 in_half = project(half, point);
  EXPECT_NEAR(in_half.x + 0.5, 0.5 * (in_large.x + 0.5), 1e-9);
  EXPECT_NEAR(in_half.y + 0.5, 0.5 * (in_large.y + 0.5), 1e-9);
  // 4:3 from 16:9: the height fits, 160 columns are cut on each side.
  const Camera cropped = scaled_camera(large, 960, 720);
  const glm::dvec2 in_cropped = project(cropped, point);
  EXPECT_NEAR(in_cropped.x, in_large.x - 160.0, 1e-9);
  EXPECT_NEAR(in_cropped.y, in_large.y, 1e-9);
}

TEST(Camera, GlProjectionPutsPixelCentresOnPixelCentres) {
  Camera camera = lens();
  camera.distortion = {};
  const double near_plane = 0.25;
  const double far_plane = 40.0;
  const glm::mat4 gl = gl_projection(camera, near_plane, far_plane);
  for (const cv::Point3d& p :
       {cv::Point3d(0, 0, 0.25), {0.3, -0.2, 1.1}, {-0.5, 0.4, 0.9}, {2, 1, 7}, {1, -3, 40}}) {
    std::vector<cv::Point2d> pixel;
    cv::projectPoints(std::vector<cv::Point3d>{p}, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0),
                      test::camera_matrix(camera), cv::noArray(), pixel);
    const glm::vec4 clip = gl * glm::vec4(p.x, -p.y, -p.z, 1.0);
    // GL's viewport transform: window x = (ndc + 1) / 2 * width, centres at half pixels, y up.
    const double window_x = 0.5 * (static_cast<double>(clip.x / clip.w) + 1.0) * camera.width;
    const double window_y = 0.5 * (static_cast<double>(clip.y / clip.w) + 1.0) * camera.height;
    EXPECT_NEAR(window_x - 0.5, pixel[0].x, 2e-3);
    EXPECT_NEAR(camera.height - window_y - 0.5, pixel[0].y, 2e-3);
    const double depth =
        (far_plane + near_plane - 2 * far_plane * near_plane / p.z) / (far_plane - near_plane);
    EXPECT_NEAR(static_cast<double>(clip.z / clip.w), depth, 1e-5);
  }
}

}  // namespace
}  // namespace modar
