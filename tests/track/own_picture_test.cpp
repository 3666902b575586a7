// Pictures that a visitor takes, through the C API: the same bytes and poses as if they had been
// baked.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>

#include "bake/pattern/pattern.hpp"
#include "modar/modar.h"
#include "tests/track/pose_loop_samples.hpp"

namespace modar {
namespace {

using namespace test;  // the samples

modar_bundle* opened(const std::vector<std::byte>& bytes) {
  return modar_bundle_open_bytes(bytes.data(), bytes.size(), nullptr);
}

modar_tracker* tracker_of(const modar_bundle* bundle) {
  auto camera = sized<modar_camera>();
  modar_camera_default(kWidth, kHeight, &camera);
  return modar_tracker_create(bundle, &camera, nullptr, nullptr);
}

modar_record* record_by_capi(const GrayImage& image, modar_error* error = nullptr) {
  return modar_record_create(image.pixels, static_cast<std::size_t>(image.stride), image.width,
                             image.height, error);
}

TEST(OwnPicture, IsTrackedAsIfItHadBeenBaked) {
  const std::vector<std::byte> baked = make_tracker_record(gray(picture()), {}).value();
  modar_record* const made = record_by_capi(gray(picture()));
  ASSERT_NE(made, nullptr);
  std::size_t size = 0;
  const void* const bytes = modar_record_bytes(made, &size);
  ASSERT_EQ(size, baked.size());
  EXPECT_EQ(std::memcmp(bytes, baked.data(), size), 0);
  modar_record* const kept = modar_record_open(bytes, size, nullptr);
  ASSERT_NE(kept, nullptr);
  modar_record_close(made);

  const std::vector<std::byte> other = record_of(textured_picture(300, 240, 77));
  const auto alone = bundle_with({other});
  const auto both = bundle_with({other, baked});
  modar_bundle* const bundles[] = {opened(alone), opened(both)};
  modar_tracker* const trackers[] = {tracker_of(bundles[0]), tracker_of(bundles[1])};
  std::uint32_t number = 99;
  ASSERT_EQ(modar_tracker_add_pattern(trackers[0], kept, &number, nullptr), MODAR_OK);
  EXPECT_EQ(number, 1u);
  modar_record_close(kept);  // it was copied
  const GrayPicture background = clutter(kWidth, kHeight, 3);
  int visible = 0;
  for (int i = 0; i < 5; ++i) {
    const SceneFrame frame = frame_of(look_at(3.0 + 0.1 * i, 20, 60, 5), background);
    modar_pose poses[2];
    for (std::size_t k = 0; k < 2; ++k) {
      poses[k] = sized<modar_pose>();
      ASSERT_EQ(modar_tracker_step(trackers[k], frame.picture.pixels.data(), kWidth, -1, nullptr),
                0);
      visible += modar_tracker_pose(trackers[k], 1, &poses[k]);
    }
    EXPECT_EQ(std::memcmp(&poses[0], &poses[1], sizeof poses[0]), 0) << "frame " << i;
  }
  EXPECT_EQ(visible, 10);
  for (std::size_t k = 0; k < 2; ++k) {
    modar_tracker_destroy(trackers[k]);
    modar_bundle_close(bundles[k]);
  }
}

TEST(OwnPicture, IsRefusedWhereItCannotBeRecognised) {
  auto error = sized<modar_error>();
  EXPECT_EQ(record_by_capi(plain(200, 160, 90).view(), &error), nullptr);
  EXPECT_STREQ(error.code, "pattern.no-features");
  GrayPicture strokes = plain(300, 240, 255);
  for (int y = 60; y < 64; ++y)
    std::memset(&strokes.pixels[static_cast<std::size_t>(y) * 300 + 40], 0, 180);
  for (int y = 60; y < 200; ++y)
    std::memset(&strokes.pixels[static_cast<std::size_t>(y) * 300 + 150], 0, 5);
  EXPECT_EQ(record_by_capi(strokes.view(), &error), nullptr);
  EXPECT_STREQ(error.code, "pattern.plain");
  EXPECT_NE(std::string(error.cure).find("more detail"), std::string::npos);
  EXPECT_EQ(record_by_capi(plain(16, 200, 0).view(), &error), nullptr);
  EXPECT_STREQ(error.code, "pattern.loop-size");
}

TEST(OwnPicture, BytesThatAreDamagedAreRefused) {
  std::vector<std::byte> bytes = record();
  auto error = sized<modar_error>();
  for (const std::size_t cut : {std::size_t{0}, std::size_t{100}, bytes.size() - 1}) {
    EXPECT_EQ(modar_record_open(bytes.data(), cut, &error), nullptr) << cut;
    EXPECT_STREQ(error.code, "tracker.record");
  }
  bytes[0] = std::byte{2};  // another feature extractor
  EXPECT_EQ(modar_record_open(bytes.data(), bytes.size(), &error), nullptr);
  EXPECT_STREQ(error.code, "tracker.record");
  bytes[0] = std::byte{1};
  bytes[4] = std::byte{0xFF};  // more features than there are
  EXPECT_EQ(modar_record_open(bytes.data(), bytes.size(), &error), nullptr);
  EXPECT_EQ(modar_record_open(nullptr, 8, &error), nullptr);
  EXPECT_STREQ(error.code, "capi.null");
  std::size_t size = 7;
  EXPECT_EQ(modar_record_bytes(nullptr, &size), nullptr);
  EXPECT_EQ(size, 0u);
  modar_record_close(nullptr);
  EXPECT_EQ(modar_tracker_add_pattern(nullptr, nullptr, nullptr, &error), MODAR_USAGE);
}

/// A photo of a picture on a green table, which its corners say.
std::vector<std::uint8_t> photo_of(const cv::Mat& print, const double (&corners)[8], int width,
                                   int height) {
  // Where a pixel is on the picture is solved by Newton's method, which has nothing in common with
  // the code under test.
  std::vector<std::uint8_t> rgba;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double u = 0.5;
      double v = 0.5;
      const auto place = [&](double across, double down) {
        // A plane in perspective; the fourth corner follows.
        const double w = 1 + 0.2 * across + 0.1 * down;
        return std::array<double, 2>{(corners[0] + (1.2 * corners[2] - corners[0]) * across +
                                      (1.1 * corners[6] - corners[0]) * down) /
                                         w,
                                     (corners[1] + (1.2 * corners[3] - corners[1]) * across +
                                      (1.1 * corners[7] - corners[1]) * down) /
                                         w};
      };
      for (int step = 0; step < 12; ++step) {
        const auto at = place(u, v);
        const auto right = place(u + 1e-6, v);
        const auto below = place(u, v + 1e-6);
        const double xu = (right[0] - at[0]) / 1e-6;
        const double yu = (right[1] - at[1]) / 1e-6;
        const double xv = (below[0] - at[0]) / 1e-6;
        const double yv = (below[1] - at[1]) / 1e-6;
        const double dx = x + 0.5 - at[0];
        const double dy = y + 0.5 - at[1];
        u += (yv * dx - xv * dy) / (xu * yv - xv * yu);
        v += (xu * dy - yu * dx) / (xu * yv - xv * yu);
      }
      const bool inside = u >= 0 && u < 1 && v >= 0 && v < 1;
      const int column = inside ? static_cast<int>(u * print.cols) : 0;
      const int row = inside ? static_cast<int>(v * print.rows) : 0;
      const int value = inside ? print.at<std::uint8_t>(row, column) : 0;
      // The table is green: no gray is like it.
      for (const int channel : {value, inside ? value : 160, value, 255}) {
        rgba.push_back(static_cast<std::uint8_t>(channel));
      }
    }
  }
  return rgba;
}

TEST(OwnPicture, IsCutOutOfAPhoto) {
  const cv::Mat print = textured_picture(300, 240, 77);
  constexpr int kPhotoWidth = 640;
  constexpr int kPhotoHeight = 480;
  constexpr double kTrue[8] = {120, 90, 520, 60, 0, 0, 150, 400};
  const auto rgba_picture = [](const std::vector<std::uint8_t>& pixels) {
    auto picture = sized<modar_picture>();
    picture.format = MODAR_RGBA;
    picture.width = kPhotoWidth;
    picture.height = kPhotoHeight;
    picture.planes[0] = pixels.data();
    picture.strides[0] = 4 * kPhotoWidth;
    return picture;
  };
  const std::vector<std::uint8_t> photo = photo_of(print, kTrue, kPhotoWidth, kPhotoHeight);
  // The fourth corner, by the matrix that photo_of() uses.
  const double far_x = (kTrue[0] + 1.2 * kTrue[2] - kTrue[0] + 1.1 * kTrue[6] - kTrue[0]) / 1.3;
  const double far_y = (kTrue[1] + 1.2 * kTrue[3] - kTrue[1] + 1.1 * kTrue[7] - kTrue[1]) / 1.3;
  const double wanted[8] = {120, 90, 520, 60, far_x, far_y, 150, 400};
  float corners[8] = {};
  modar_picture taken = rgba_picture(photo);
  ASSERT_EQ(modar_photo_corners(&taken, corners), 1);
  for (int i = 0; i < 8; ++i) EXPECT_NEAR(corners[i], wanted[i], 6) << i;
  for (int i = 0; i < 8; ++i) corners[i] = static_cast<float>(wanted[i]);
  std::vector<std::uint8_t> flat(std::size_t{MODAR_FLAT_SIDE} * MODAR_FLAT_SIDE);
  int width = 0;
  int height = 0;
  ASSERT_EQ(modar_photo_flat(&taken, corners, flat.data(), &width, &height), 1);
  ASSERT_GT(width, 200);
  ASSERT_LE(std::max(width, height), int{MODAR_FLAT_SIDE});
  double off = 0;
  int compared = 0;
  for (int y = 5; y < height - 5; ++y) {
    for (int x = 5; x < width - 5; ++x, ++compared) {
      const int column = static_cast<int>((x + 0.5) / width * print.cols);
      const int row = static_cast<int>((y + 0.5) / height * print.rows);
      off += std::abs(flat[static_cast<std::size_t>(y * width + x)] -
                      print.at<std::uint8_t>(row, column));
    }
  }
  EXPECT_LT(off / compared, 8.0);  // a picture that is shifted by two pixels is off by 20 and more
  std::swap(corners[0], corners[2]);  // crossed
  EXPECT_EQ(modar_photo_flat(&taken, corners, flat.data(), &width, &height), 0);
  const std::vector<std::uint8_t> table(std::size_t{4} * kPhotoWidth * kPhotoHeight, 90);
  taken = rgba_picture(table);
  EXPECT_EQ(modar_photo_corners(&taken, corners), 0);
  taken.width = taken.height = 1;
  EXPECT_EQ(modar_photo_corners(&taken, corners), 0);
  taken.planes[0] = nullptr;
  EXPECT_EQ(modar_photo_corners(&taken, corners), 0);
  EXPECT_EQ(modar_photo_corners(nullptr, corners), 0);
}

}  // namespace
}  // namespace modar
