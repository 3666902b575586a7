// Pictures that a visitor takes, through the C API: the same bytes and poses as if they had been
// baked.
#include <gtest/gtest.h>

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
  return modar_tracker_create(bundle, &camera, nullptr);
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
      ASSERT_EQ(modar_tracker_step(trackers[k], frame.picture.pixels.data(), kWidth, nullptr), 0);
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

}  // namespace
}  // namespace modar
