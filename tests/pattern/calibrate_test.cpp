// Calibration against cameras that are known, and against OpenCV's own of real photos.
#include "bake/pattern/calibrate.hpp"

#include <filesystem>

#include <unistd.h>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/trial.hpp"
#include "formats/base/atomic_file.hpp"
#include "formats/bundle_view.hpp"
#include "modar/camera_file.hpp"
#include "tests/track/synthetic.hpp"

namespace modar {
namespace {

namespace fs = std::filesystem;

class Calibrate : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("modar_calibrate_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const { return folder_ / name; }

  enum class Tilted { kToAllSides, kAboutOneAxis, kToOneSide };

  /// Views of a flat picture, with noise, as PNG files.
  std::vector<std::string> film(const cv::Mat& picture, const Camera& camera, int views,
                                double tilt, Tilted sides = Tilted::kToAllSides) {
    cv::RNG random(4);
    std::vector<std::string> files;
    for (int i = 0; i < views; ++i) {
      const double roll = 17.0 * i;
      const double axis = sides == Tilted::kToAllSides ? 360.0 * i / views : 70.0 - roll;
      const double share = sides == Tilted::kAboutOneAxis ? 2.0 * i / (views - 1) - 1 : 1;
      const test::View view = test::look_at(2.7, tilt * share, axis, roll, 0.3 * std::cos(2.0 * i),
                                            0.25 * std::sin(3.0 * i));
      cv::Mat frame = test::render(picture, view, camera,
                                   cv::Mat(camera.height, camera.width, CV_8UC1, cv::Scalar(150)));
      cv::Mat noise(frame.size(), CV_16SC1);
      random.fill(noise, cv::RNG::NORMAL, 0, 3);
      cv::add(frame, noise, frame, cv::noArray(), CV_8U);
      files.push_back(path("view" + std::to_string(i) + ".png"));
      EXPECT_TRUE(cv::imwrite(files.back(), frame));
    }
    return files;
  }

  fs::path folder_;
};

Camera bent_camera() {
  Camera camera = default_camera(480, 360);
  camera.fx = camera.fy = 530;
  camera.cx = 247;
  camera.cy = 175;
  camera.distortion = {-0.15, 0.06, 0, 0, 0};
  return camera;
}

cv::Mat chessboard(int columns, int rows, int square) {
  cv::Mat board((rows + 3) * square, (columns + 3) * square, CV_8UC1, cv::Scalar(255));
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) {
      if ((x + y) % 2 == 0) {
        cv::rectangle(board, {(x + 1) * square, (y + 1) * square, square, square}, cv::Scalar(0),
                      cv::FILLED);
      }
    }
  }
  return board;
}

void expect_camera(const Calibration& calibration, const Camera& truth) {
  EXPECT_NEAR(calibration.camera.fx, truth.fx, 0.01 * truth.fx);
  EXPECT_NEAR(calibration.camera.fy, truth.fy, 0.01 * truth.fy);
  EXPECT_NEAR(calibration.camera.cx, truth.cx, 6);
  EXPECT_NEAR(calibration.camera.cy, truth.cy, 6);
  EXPECT_NEAR(calibration.camera.distortion[0], truth.distortion[0], 0.05);
  EXPECT_LT(calibration.rms_px, 0.6);
}

TEST_F(Calibrate, FromAChessboardThroughABentLens) {
  CalibrateOptions options;
  options.inputs = film(chessboard(7, 5, 30), bent_camera(), 8, 35);
  options.board_columns = 7;
  options.board_rows = 5;
  const auto calibration = calibrate(options, {});
  ASSERT_TRUE(calibration) << to_line(calibration.error());
  EXPECT_EQ(calibration->frames, 8);
  EXPECT_GE(calibration->views, 7);
  EXPECT_FALSE(calibration->principal_point_assumed);
  expect_camera(*calibration, bent_camera());
}

const cv::Mat& filmed_picture() {
  static const cv::Mat kPicture = test::textured_picture(320, 260, 12);
  return kPicture;
}

/// A bundle of it.
const std::vector<std::byte>& filmed_bundle() {
  static const std::vector<std::byte> kBundle = [] {
    TrackerRecordOptions options;
    options.trial_views = 12;
    return bundle_of_pattern(test::gray(filmed_picture()), options).value();
  }();
  return kBundle;
}

TEST_F(Calibrate, FromAnyPatternThroughABentLens) {
  ASSERT_TRUE(write_file(path("pattern.modar"), filmed_bundle()));
  CalibrateOptions options;
  options.inputs = film(filmed_picture(), bent_camera(), 9, 38);
  options.pattern = path("pattern.modar");
  const auto calibration = calibrate(options, {});
  ASSERT_TRUE(calibration) << to_line(calibration.error());
  EXPECT_GE(calibration->views, 7);
  expect_camera(*calibration, bent_camera());

  // The player reads the written file.
  ASSERT_TRUE(write_camera_file(*calibration, path("camera.yml")));
  const auto camera = read_camera_file(path("camera.yml"));
  ASSERT_TRUE(camera) << to_line(camera.error());
  EXPECT_EQ(camera->width, 480);
  EXPECT_EQ(camera->height, 360);
  EXPECT_NEAR(camera->fx, calibration->camera.fx, 1e-9);
  EXPECT_NEAR(camera->distortion[0], calibration->camera.distortion[0], 1e-12);
}

TEST_F(Calibrate, FromAPrintOfAnotherAspectThanItsPicture) {
  ASSERT_TRUE(write_file(path("pattern.modar"), filmed_bundle()));
  cv::Mat print;
  cv::resize(filmed_picture(), print, {}, 1.0, 1.1, cv::INTER_AREA);
  CalibrateOptions options;
  options.inputs = film(print, bent_camera(), 12, 38);
  options.pattern = path("pattern.modar");
  const auto calibration = calibrate(options, {});
  ASSERT_TRUE(calibration) << to_line(calibration.error());
  const Camera truth = bent_camera();
  EXPECT_NEAR(calibration->camera.fx, truth.fx, 0.03 * truth.fx);
  EXPECT_NEAR(calibration->camera.fx, truth.fx, 3.0 * calibration->focal_spread);
  EXPECT_NEAR(calibration->camera.cy, truth.cy, 12);
}

TEST_F(Calibrate, TiltsAboutOneAxisTellTheFocalLengthAndNoPrincipalPoint) {
  Camera camera = bent_camera();
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  CalibrateOptions options;
  options.inputs = film(chessboard(7, 5, 30), camera, 8, 45, Tilted::kAboutOneAxis);
  options.board_columns = 7;
  options.board_rows = 5;
  const auto calibration = calibrate(options, {});
  ASSERT_TRUE(calibration) << to_line(calibration.error());
  EXPECT_TRUE(calibration->principal_point_assumed);
  EXPECT_DOUBLE_EQ(calibration->camera.cx, camera.cx);
  expect_camera(*calibration, camera);
}

TEST_F(Calibrate, SaysWhatIsMissing) {
  CalibrateOptions options;
  options.board_columns = 7;
  options.board_rows = 5;
  options.inputs = film(chessboard(7, 5, 30), bent_camera(), 3, 35);
  const auto few = calibrate(options, {});
  ASSERT_FALSE(few);
  EXPECT_EQ(few.error().code, "calibrate.few-views");
  options.inputs = film(chessboard(7, 5, 30), bent_camera(), 5, 0);
  const auto frontal = calibrate(options, {});
  ASSERT_FALSE(frontal);
  EXPECT_EQ(frontal.error().code, "calibrate.weak");
  // A solver makes up a camera that fits such views well.
  options.inputs = film(chessboard(7, 5, 30), bent_camera(), 6, 50, Tilted::kToOneSide);
  const auto one_side = calibrate(options, {});
  ASSERT_FALSE(one_side);
  EXPECT_EQ(one_side.error().code, "calibrate.weak");
  EXPECT_NE(one_side.error().cause.find("to the same side"), std::string::npos)
      << one_side.error().cause;
  cv::imwrite(path("other.png"), cv::Mat(100, 100, CV_8UC1, cv::Scalar(9)));
  options.inputs = {options.inputs[0], path("other.png")};
  EXPECT_EQ(calibrate(options, {}).error().code, "calibrate.size");
  options.inputs = {path("nowhere.mp4")};
  EXPECT_EQ(calibrate(options, {}).error().code, "calibrate.input");
}

TEST_F(Calibrate, RealPhotosAsOpenCvHasThem) {
  const std::string data = test::opencv_photos();
  if (data.empty()) GTEST_SKIP() << "opencv-doc is not installed";
  const auto known = read_camera_file(data + "/left_intrinsics.yml");
  ASSERT_TRUE(known) << to_line(known.error());
  CalibrateOptions options;
  for (const auto& entry : fs::directory_iterator(data)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("left") && name.size() == 10) options.inputs.push_back(entry.path());
  }
  ASSERT_EQ(options.inputs.size(), 13u);
  options.board_columns = 9;
  options.board_rows = 6;
  const auto calibration = calibrate(options, {});
  ASSERT_TRUE(calibration) << to_line(calibration.error());
  EXPECT_NEAR(calibration->camera.fx, known->fx, 0.01 * known->fx);
  EXPECT_NEAR(calibration->camera.fy, known->fy, 0.01 * known->fy);
  EXPECT_NEAR(calibration->camera.cx, known->cx, 5);
}

}  // namespace
}  // namespace modar
