// Calibration files as OpenCV's own programs write them.
#include "modar/camera_file.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "files.hpp"
#include "runtime/play/vision.hpp"

namespace modar {
namespace {

TEST(CameraFile, ReadsWhatOpenCvWrites) {
  const test::Folder folder;
  const std::string path = folder / "camera.yml";
  {
    cv::FileStorage file(path, cv::FileStorage::WRITE);
    file << "image_width" << 640 << "image_height" << 480;
    file << "camera_matrix" << (cv::Mat_<double>(3, 3) << 536, 0, 342, 0, 537, 235, 0, 0, 1);
    file << "distortion_coefficients"
         << (cv::Mat_<double>(5, 1) << -0.26, 0.04, 0.002, -0.0003, 0.02);
  }
  const Result<Camera> camera = read_camera_file(path);
  ASSERT_TRUE(camera) << to_line(camera.error());
  EXPECT_EQ(camera->width, 640);
  EXPECT_EQ(camera->height, 480);
  EXPECT_EQ(camera->fx, 536);
  EXPECT_EQ(camera->fy, 537);
  EXPECT_EQ(camera->cx, 342);
  EXPECT_EQ(camera->cy, 235);
  EXPECT_EQ(camera->distortion, (std::array{-0.26, 0.04, 0.002, -0.0003, 0.02}));
}

TEST(CameraFile, ReadsTheOtherNamesFloatsAndRows) {
  const test::Folder folder;
  const std::string path = folder / "camera.xml";
  {
    cv::FileStorage file(path, cv::FileStorage::WRITE);
    file << "cameraMatrix" << (cv::Mat_<float>(3, 3) << 500, 0, 320, 0, 500, 240, 0, 0, 1);
    file << "distCoeffs" << (cv::Mat_<float>(1, 4) << 0.5, 0.25, 0, 0);
  }
  const Result<Camera> camera = read_camera_file(path);
  ASSERT_TRUE(camera) << to_line(camera.error());
  EXPECT_EQ(camera->fx, 500);
  EXPECT_EQ(camera->distortion, (std::array{0.5, 0.25, 0.0, 0.0, 0.0}));
  EXPECT_EQ(camera->width, 0);
  const Camera fitted = camera_for(*camera, 640, 480);
  EXPECT_EQ(fitted.width, 640);
  EXPECT_EQ(fitted.fx, 500);
}

std::string read_code(const std::string& text) {
  const test::Folder folder;
  test::write_text(folder / "camera.yml", text);
  const Result<Camera> camera = read_camera_file(folder / "camera.yml");
  return camera ? "read" : camera.error().code;
}

TEST(CameraFile, SaysWhatIsWrong) {
  EXPECT_EQ(read_camera_file("/nowhere/camera.yml").error().code, "camera.open");
  EXPECT_EQ(read_code("%YAML:1.0\n---\nx: 1\n"), "camera.matrix");
  EXPECT_EQ(read_code("%YAML:1.0\n---\nK: [ -1., 0, 0, 0, 1, 0, 0, 0, 1 ]\n"), "camera.matrix");
  EXPECT_EQ(read_code("%YAML:1.0\n---\nK: [ 1., 0, 0, 0, 1, 0, 0, 0, 1 ]\n"), "read");
  EXPECT_EQ(read_code("%YAML:1.0\n---\nK: [ 1., 0, 0, 0, 1, 0, 0, 0, 1 ]\n"
                      "D: [ 0., 0., 0., 0., 0., 0.5, 0., 0. ]\n"),
            "camera.distortion");
  EXPECT_EQ(read_code("%YAML:1.0\n---\nK: [ 1., 0, 0, 0, 1, 0, 0, 0, 1 ]\n"
                      "image_width: 640\nimage_height: 0\n"),
            "camera.size");
  const std::string broken =
      read_code("%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: [\n");
  EXPECT_TRUE(broken == "camera.syntax" || broken == "camera.matrix") << broken;
}

}  // namespace
}  // namespace modar
