// The C API where C++ has no test of its own: assets inside other files, camera files, versions,
// options.
#include "modar/modar.h"

#include <fcntl.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "tests/render/scene.hpp"

namespace modar {
namespace {

Triangle one_triangle() {
  Triangle triangle;
  triangle.corners = {glm::dvec3(-1, -1, 0), {1, -1, 0}, {0, 1, 0}};
  return triangle;
}

class CapiTest : public ::testing::Test {
 protected:
  void SetUp() override {
    SceneMaker maker;
    maker.add_plain_model(Layout::kHalfColoured, {one_triangle()});
    bundle_ = std::make_unique<MappedBundle>(maker.content);
    path_ = bundle_->path + ".apk";
  }
  void TearDown() override { std::remove(path_.c_str()); }

  /// A file with the bundle's bytes behind so many others, and some more.
  void write_asset(std::size_t offset) const {
    const auto bytes = bundle_->view->bytes();
    std::ofstream file(path_, std::ios::binary);
    file << std::string(offset, 'x');
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    file << "tail";
  }

  std::unique_ptr<MappedBundle> bundle_;
  std::string path_;
};

TEST_F(CapiTest, OpensAnAssetWhereverItLies) {
  const auto size = static_cast<std::int64_t>(bundle_->view->bytes().size());
  // zipalign puts assets at multiples of 4.
  for (const std::size_t offset : {0u, 4u, 8u, 12u, 4092u, 4096u, 4100u, 70004u}) {
    write_asset(offset);
    const int file = open(path_.c_str(), O_RDONLY);
    ASSERT_GE(file, 0);
    modar_error error{};
    modar_bundle* bundle =
        modar_bundle_open_fd(file, static_cast<std::int64_t>(offset), size, &error);
    close(file);
    ASSERT_NE(bundle, nullptr) << offset << ": " << error.code << " " << error.cause;
    EXPECT_EQ(modar_model_count(bundle), 1u);
    EXPECT_EQ(modar_pattern_width_mm(bundle, 0), 0.0) << "no such pattern";
    modar_bundle_close(bundle);
  }
}

TEST_F(CapiTest, RefusesARangeThatTheFileDoesNotHold) {
  const auto size = static_cast<std::int64_t>(bundle_->view->bytes().size());
  write_asset(8);
  const int file = open(path_.c_str(), O_RDONLY);
  for (const auto& [offset, length] : {std::pair<std::int64_t, std::int64_t>{8, size + 5},
                                       {size * 2, 10},
                                       {8, 0},
                                       {-8, 10},
                                       {8, -1}}) {
    modar_error error{};
    EXPECT_EQ(modar_bundle_open_fd(file, offset, length, &error), nullptr);
    EXPECT_STREQ(error.code, "io.range") << offset << " " << length;
  }
  close(file);
  modar_error error{};
  EXPECT_EQ(modar_bundle_open_fd(-1, 0, 10, &error), nullptr);
  EXPECT_STREQ(error.code, "io.map");
}

TEST_F(CapiTest, TakesBytesAtAnyMultipleOfFour) {
  const auto bytes = bundle_->view->bytes();
  std::vector<std::uint64_t> room(bytes.size() / 8 + 602);
  for (std::size_t i = 0; i < 1200; ++i) {
    auto* start = reinterpret_cast<std::byte*>(room.data()) + 4 * i;
    std::memcpy(start, bytes.data(), bytes.size());
    modar_error error{};
    modar_bundle* bundle = modar_bundle_open_bytes(start, bytes.size(), &error);
    ASSERT_NE(bundle, nullptr) << error.cause;
    EXPECT_EQ(modar_model_count(bundle), 1u);
    modar_bundle_close(bundle);
  }
}

TEST_F(CapiTest, ReadsTheFileThatCalibrateWrites) {
  std::ofstream(path_)
      << "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
         "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
         "   data: [ 5.3612345678901234e+02, 0., 342.5, 0., 5.37e2, 235., 0.,\n       0., 1. ]\n"
         "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
         "   data: [ -2.65e-01, -4.67e-02, 1.83e-03, -3.14e-04, 2.52e-01 ]\n";
  modar_camera camera{};
  modar_error error{};
  ASSERT_EQ(modar_camera_read(path_.c_str(), &camera, &error), 0) << error.cause;
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  EXPECT_NEAR(camera.fx, 536.12345678901234, 1e-11);
  EXPECT_DOUBLE_EQ(camera.cx, 342.5);
  EXPECT_DOUBLE_EQ(camera.fy, 537);
  EXPECT_DOUBLE_EQ(camera.cy, 235);
  const double coefficients[] = {-0.265, -0.0467, 0.00183, -0.000314, 0.252};
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(camera.distortion[i], coefficients[i], 1e-15);
}

TEST_F(CapiTest, RefusesDamagedCameraFiles) {
  const std::pair<const char*, const char*> files[] = {
      {"", "camera.open"},
      {"image_width: 640\n", "camera.matrix"},
      {"camera_matrix: !!opencv-matrix\n data: [ 1, 0, 0 ]\n", "camera.matrix"},
      {"camera_matrix: !!opencv-matrix\n data: [ 0, 0, 1, 0, 1, 1, 0, 0, 1 ]\n", "camera.matrix"},
      {"camera_matrix: !!opencv-matrix\n data: [ .Nan, 0, 1, 0, 1, 1, 0, 0, 1 ]\n",
       "camera.matrix"},
      {"camera_matrix: !!opencv-matrix\n data: [ 1e400, 0, 1, 0, 1, 1, 0, 0, 1 ]\n",
       "camera.matrix"},
      {"camera_matrix: [ 1, 0, 1, 0, 1, 1, 0, 0, 1 ]\nimage_width: -4\n", "camera.size"},
      {"camera_matrix: [ 1, 0, 1, 0, 1, 1, 0, 0, 1 ]\ndistortion_coefficients: [ 1, x ]\n",
       "camera.distortion"},
      {"camera_matrix: [ 1, 0, 1, 0, 1, 1, 0, 0, 1 ]\ndistortion_coefficients: [ 0, 0, 0, 0, 0, 1 "
       "]\n",
       "camera.distortion"},
  };
  for (const auto& [text, code] : files) {
    std::ofstream(path_) << text;
    modar_camera camera{};
    modar_error error{};
    EXPECT_NE(modar_camera_read(path_.c_str(), &camera, &error), 0) << text;
    EXPECT_STREQ(error.code, code) << text;
  }
}

TEST_F(CapiTest, RefusesACameraThatCannotBe) {
  modar_error error{};
  modar_bundle* bundle = modar_bundle_open(bundle_->path.c_str(), &error);
  ASSERT_NE(bundle, nullptr);
  const double bad[] = {0.0, -1.0, std::nan(""), HUGE_VAL};
  for (const double focal : bad) {
    modar_camera camera = modar_camera_default(64, 48);
    camera.fx = focal;
    EXPECT_EQ(modar_tracker_create(bundle, &camera, &error), nullptr);
    EXPECT_STREQ(error.code, "camera.matrix") << focal;
  }
  modar_camera camera = modar_camera_default(64, 48);
  camera.distortion[2] = std::nan("");
  EXPECT_EQ(modar_tracker_create(bundle, &camera, &error), nullptr);
  EXPECT_STREQ(error.code, "camera.distortion");
  camera = modar_camera_default(0, 48);
  EXPECT_EQ(modar_tracker_create(bundle, &camera, &error), nullptr);
  EXPECT_STREQ(error.code, "camera.size");
  modar_bundle_close(bundle);
}

TEST_F(CapiTest, ShrinksByTheMeanOfSquares) {
  constexpr int kWide = 23;  // no multiple of the factor: the rest is left out
  constexpr int kHigh = 11;
  constexpr std::size_t kStride = 29;
  std::vector<std::uint8_t> gray(kStride * kHigh);
  for (std::size_t i = 0; i < gray.size(); ++i) gray[i] = static_cast<std::uint8_t>(i * i * 7919);
  for (const int factor : {1, 2, 3, 5}) {
    const int columns = kWide / factor;
    const int rows = kHigh / factor;
    std::vector<std::uint8_t> expected;
    for (int i = 0; i < columns * rows; ++i) {
      double sum = 0;
      for (int k = 0; k < factor * factor; ++k) {
        const int x = i % columns * factor + k % factor;
        const int y = i / columns * factor + k / factor;
        sum += gray[static_cast<std::size_t>(y) * kStride + static_cast<std::size_t>(x)];
      }
      expected.push_back(static_cast<std::uint8_t>(std::floor(sum / (factor * factor) + 0.5)));
    }
    std::vector<std::uint8_t> in_place = gray;
    modar_shrink(in_place.data(), kStride, kWide, kHigh, factor, in_place.data());
    in_place.resize(expected.size());
    EXPECT_EQ(in_place, expected) << factor;
  }
}

TEST_F(CapiTest, StatesAModelsBox) {
  modar_error error{};
  const auto bytes = bundle_->view->bytes();
  modar_bundle* bundle = modar_bundle_open_bytes(bytes.data(), bytes.size(), &error);
  ASSERT_NE(bundle, nullptr) << error.cause;
  float low[3] = {7, 7, 7};
  float high[3] = {7, 7, 7};
  EXPECT_EQ(modar_model_bounds(bundle, 1, low, high), 0);
  EXPECT_EQ(low[0], 7);
  ASSERT_EQ(modar_model_bounds(bundle, 0, low, high), 1);
  const float corners[2][3] = {{-1, -1, 0}, {1, 1, 0}};  // of one_triangle()
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(low[axis], corners[0][axis], 0.002) << axis;  // boxes hold what halves make of them
    EXPECT_NEAR(high[axis], corners[1][axis], 0.002) << axis;
  }
  modar_bundle_close(bundle);
}

TEST_F(CapiTest, StatesItsVersion) {
  EXPECT_EQ(modar_version(), static_cast<std::uint32_t>(MODAR_VERSION_NUMBER));
}

}  // namespace
}  // namespace modar
