// The encoder: exact where blocks can be exact, better than libetc1, the same for any thread count.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "bake/image/difference.hpp"
#include "bake/texture/etc1/etc1_encoder.hpp"
#include "bake/texture/etc1/etc1_kernel.hpp"
#include "tests/texture/etc1_block.hpp"
#include "tests/texture/libetc1.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

double quality(const RgbaImage& image) {
  return psnr_db(image, decode_texture(TextureFormat::kEtc1Rgb, encode_etc1(image), image.width,
                                       image.height));
}
double quality_of_libetc1(const RgbaImage& image) {
  return psnr_db(image, decode_texture(TextureFormat::kEtc1Rgb, test::libetc1_encode(image),
                                       image.width, image.height));
}

constexpr TextureEffort kEfforts[] = {TextureEffort::kFast, TextureEffort::kGood,
                                      TextureEffort::kBest};

/// Sum of squared errors of a colour block with one modifier, tried for all that the format has.
int best_solid_error(const std::array<int, 3>& colour) {
  constexpr int kSizes[] = {2, 8, 5, 17, 9, 29, 13, 42, 18, 60, 24, 80, 33, 106, 47, 183};
  int best = 1 << 30;
  for (const int size : kSizes) {
    for (const int add : {size, -size}) {
      for (const int bits : {4, 5}) {
        int error = 0;
        for (const int value : colour) {
          int nearest = 256;
          for (int q = 0; q < 1 << bits; ++q) {
            const int wide = bits == 4 ? q * 16 + q : q * 8 + q / 4;
            const int shown = std::clamp(wide + add, 0, 255);
            nearest = std::min(nearest, std::abs(shown - value));
          }
          error += nearest * nearest;
        }
        best = std::min(best, error);
      }
    }
  }
  return best;
}

TEST(Etc1Encoder, FlatBlocksAreTheBestThatTheFormatHas) {
  std::mt19937 random(9);
  for (int i = 0; i < 40; ++i) {
    const auto value = [&random] { return static_cast<int>(random() % 256); };
    const std::array<int, 3> colour = {value(), value(), value()};
    const RgbaImage image =
        test::paint(4, 4, [&colour](std::uint32_t, std::uint32_t) { return colour; });
    const RgbaImage decoded = decode_texture(TextureFormat::kEtc1Rgb, encode_etc1(image), 4, 4);
    int error = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const int d = int{decoded.pixels[c]} - colour[c];
      error += d * d;
    }
    EXPECT_EQ(error, best_solid_error(colour)) << colour[0] << " " << colour[1] << " " << colour[2];
    for (std::size_t k = 4; k < 64; ++k) EXPECT_EQ(decoded.pixels[k], decoded.pixels[k - 4]);
  }
}

TEST(Etc1Encoder, BlackWithWhiteIsExactAtEveryEffort) {
  // 255 = 119 + 183 and 0 = 119 - 183, both clamped: every mixture is within the format.
  const RgbaImage image = test::paint(64, 64, [](std::uint32_t x, std::uint32_t y) {
    const std::uint32_t block = y / 4 * 16 + x / 4;
    const unsigned mask = block * 2654435761U >> 16;
    const int value = (mask >> (4 * (y % 4) + x % 4) & 1) != 0 ? 255 : 0;
    return std::array<int, 3>{value, value, value};
  });
  for (const TextureEffort effort : kEfforts) {
    const std::vector<std::byte> blocks = encode_etc1(image, {.effort = effort});
    EXPECT_EQ(decode_texture(TextureFormat::kEtc1Rgb, blocks, 64, 64).pixels, image.pixels)
        << static_cast<int>(effort);
  }
}

TEST(Etc1Encoder, BestRecoversBlocksThatTheFormatHolds) {
  // Colours well within 0-255, so that nothing is clamped away.
  std::mt19937 random(5);
  std::vector<std::byte> blocks;
  for (int i = 0; i < 64; ++i) {
    test::Etc1Block block;
    block.flip = i % 2 != 0;
    for (std::size_t half = 0; half < 2; ++half) {
      block.table[half] = static_cast<int>(random() % 4);
      for (int& base : block.base[half]) base = 4 + static_cast<int>(random() % 8);
    }
    for (std::uint8_t& code : block.code) code = static_cast<std::uint8_t>(random() % 4);
    std::array<std::byte, 8> bytes{};
    test::pack_etc1(block, bytes);
    blocks.insert(blocks.end(), bytes.begin(), bytes.end());
  }
  const RgbaImage image = decode_texture(TextureFormat::kEtc1Rgb, blocks, 32, 32);
  const std::vector<std::byte> again = encode_etc1(image, {.effort = TextureEffort::kBest});
  EXPECT_EQ(decode_texture(TextureFormat::kEtc1Rgb, again, 32, 32).pixels, image.pixels);
}

TEST(Etc1Encoder, EachEffortIsBetterThanTheOneBelow) {
  const RgbaImage photo = test::synthetic_photo(64, 64);
  double before = quality_of_libetc1(photo);
  for (const TextureEffort effort : kEfforts) {
    const double db = psnr_db(
        photo,
        decode_texture(TextureFormat::kEtc1Rgb, encode_etc1(photo, {.effort = effort}), 64, 64));
    EXPECT_GT(db, before) << static_cast<int>(effort);
    before = db;
  }
}

TEST(Etc1Encoder, PerceptualSparesLuma) {
  const RgbaImage photo = test::synthetic_photo(64, 64);
  const auto luma_error = [&photo](const RgbaImage& decoded) {
    double sum = 0;
    for (std::size_t i = 0; i < photo.pixels.size(); i += 4) {
      const double weights[] = {3, 6, 1};
      for (std::size_t c = 0; c < 3; ++c) {
        const double d = double{1} * photo.pixels[i + c] - decoded.pixels[i + c];
        sum += weights[c] * d * d;
      }
    }
    return sum;
  };
  for (const TextureEffort effort : kEfforts) {
    const auto decoded = [&](bool perceptual) {
      return decode_texture(TextureFormat::kEtc1Rgb,
                            encode_etc1(photo, {.effort = effort, .perceptual = perceptual}), 64,
                            64);
    };
    EXPECT_LT(luma_error(decoded(true)), luma_error(decoded(false)) * 0.97);
  }
}

TEST(Etc1Encoder, BytesDoNotDependOnTheSimdLevel) {
  const std::vector<std::int64_t> levels = simd_levels();
  RgbaImage image = test::synthetic_photo(52, 52);
  const RgbaImage grains = test::noise(52, 20, 3);
  std::copy(grains.pixels.begin(), grains.pixels.end(), image.pixels.begin());
  for (const TextureEffort effort : kEfforts) {
    for (const bool perceptual : {false, true}) {
      const EncodeOptions options = {.effort = effort, .perceptual = perceptual};
      const std::vector<std::byte> expected = encode_etc1(image, options);
      for (const std::int64_t level : levels) {
        force_simd_level(level);
        EXPECT_EQ(encode_etc1(image, options), expected) << simd_level_name(level);
      }
      force_simd_level(0);
    }
  }
  for (const std::int64_t level : levels) RecordProperty(simd_level_name(level), "compared");
  EXPECT_GE(levels.size(), 2U) << "one SIMD level only: nothing was compared";
}

TEST(Etc1Encoder, BeatsLibetc1OnSyntheticImages) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const RgbaImage photo = test::synthetic_photo(64, 64, seed);
    EXPECT_GT(quality(photo), quality_of_libetc1(photo) + 0.3);
    const RgbaImage grains = test::noise(32, 32, seed);
    EXPECT_GT(quality(grains), quality_of_libetc1(grains) + 0.3);
  }
}

TEST(Etc1Encoder, BeatsLibetc1OnPhotos) {
  const std::filesystem::path folder = "/usr/share/doc/opencv-doc/examples/data";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "opencv-doc is not installed";
  std::vector<std::filesystem::path> files;
  for (const char* name : {"aero1.jpg", "baboon.jpg", "box_in_scene.png", "building.jpg",
                           "fruits.jpg", "graf1.png", "home.jpg", "leuvenA.jpg"})
    files.push_back(folder / name);
  double ours = 0;
  double theirs = 0;
  for (const auto& file : files) {
    const Result<RgbaImage> image = read_image(file.string());
    ASSERT_TRUE(image) << to_line(image.error());
    const RgbaImage crop = test::centre_crop(*image, 64);
    ours += quality(crop) / static_cast<double>(files.size());
    theirs += quality_of_libetc1(crop) / static_cast<double>(files.size());
  }
  EXPECT_GT(ours, theirs + 1.0);
}

TEST(Etc1Encoder, EdgePixelsFillBlocks) {
  const RgbaImage image = test::synthetic_photo(6, 5);
  const RgbaImage padded = test::paint(8, 8, [&image](std::uint32_t x, std::uint32_t y) {
    const std::uint8_t* p = &image.pixels[(std::size_t{std::min(y, 4U)} * 6 + std::min(x, 5U)) * 4];
    return std::array<std::uint8_t, 3>{p[0], p[1], p[2]};
  });
  EXPECT_EQ(encode_etc1(image), encode_etc1(padded));
}

TEST(Etc1Encoder, BytesDoNotDependOnThreads) {
  const RgbaImage image = test::synthetic_photo(229, 167);
  const std::vector<std::byte> blocks = encode_etc1(image);
  EXPECT_EQ(encode_etc1(image, {.jobs = 2}), blocks);
  EXPECT_EQ(encode_etc1(image, {.jobs = 8}), blocks);
}

}  // namespace
}  // namespace modar
