// Whole textures: sizes, levels, alpha twins, quality figures.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "bake/image/difference.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

std::string write_png(const test::ScratchFolder& folder, const RgbaImage& image) {
  cv::Mat mat(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC4);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    mat.data[i] = image.pixels[i + 2];
    mat.data[i + 1] = image.pixels[i + 1];
    mat.data[i + 2] = image.pixels[i];
    mat.data[i + 3] = image.pixels[i + 3];
  }
  const std::string path = folder.file("texture.png");
  cv::imwrite(path, mat);
  return path;
}

Texture bake(const std::string& path, const TextureOptions& options) {
  Report report;
  Result<Texture> texture = bake_texture(path, options, report);
  if (!texture) {
    ADD_FAILURE() << to_line(texture.error());
    Texture none;
    none.levels.resize(1);
    return none;
  }
  EXPECT_FALSE(report.stages.empty());
  return *texture;
}

TEST(BakeTexture, SidesBecomePowersOfTwoWithAFullChain) {
  const test::ScratchFolder folder;
  const Texture texture = bake(write_png(folder, test::synthetic_photo(100, 90)), {});
  EXPECT_EQ(texture.name, "texture.png");
  EXPECT_EQ(texture.source_width, 100U);
  EXPECT_EQ(texture.source_height, 90U);
  ASSERT_EQ(texture.levels.size(), 8U);
  EXPECT_EQ(texture.levels[0].width, 128U);
  EXPECT_EQ(texture.levels[0].height, 64U);
  EXPECT_EQ(texture.levels[7].width, 1U);
  EXPECT_EQ(texture.levels[7].height, 1U);
  for (const TextureLevel& level : texture.levels) {
    EXPECT_EQ(level.colour.size(),
              std::size_t{(level.width + 3) / 4} * ((level.height + 3) / 4) * 8);
    EXPECT_TRUE(level.alpha.empty());
    EXPECT_GT(level.psnr_db, 18);
    EXPECT_LE(level.ssim, 1.0);
  }
  EXPECT_GT(texture.levels[0].ssim, 0.9);
}

TEST(BakeTexture, LimitsAndKeepsSizes) {
  const test::ScratchFolder folder;
  const std::string path = write_png(folder, test::synthetic_photo(150, 50));
  TextureOptions options;
  options.max_side = 100;
  EXPECT_EQ(bake(path, options).levels[0].width, 64U);
  options.mipmaps = false;
  const Texture scaled = bake(path, options);
  EXPECT_EQ(scaled.levels[0].width, 100U);
  EXPECT_EQ(scaled.levels[0].height, 33U);
  EXPECT_EQ(scaled.levels.size(), 1U);
  options.max_side = 2048;
  EXPECT_EQ(bake(path, options).levels[0].width, 150U);
  options.wrap = kTextureRepeat;
  EXPECT_EQ(bake(path, options).levels[0].width, 128U);
  Report report;
  options.max_side = 0;
  const Result<Texture> refused = bake_texture(path, options, report);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().exit, ExitCode::kUsage);
}

/// Pixels of pure colours, none of them like its neighbours.
RgbaImage pure_colours(std::uint32_t width, std::uint32_t height) {
  return test::paint(width, height, [](std::uint32_t x, std::uint32_t y) {
    const std::uint32_t i = (x + 3 * y) % 6 + 1;
    return std::array<std::uint32_t, 3>{i & 1U ? 255U : 0U, i & 2U ? 255U : 0U, i & 4U ? 255U : 0U};
  });
}

TEST(BakeTexture, PalettesAreEnlargedUntilEachPixelIsABlock) {
  const test::ScratchFolder folder;
  const RgbaImage palette = pure_colours(256, 1);
  const Texture texture = bake(write_png(folder, palette), {});
  EXPECT_EQ(texture.source_width, 256U);
  ASSERT_EQ(texture.levels[0].width, 1024U);
  ASSERT_EQ(texture.levels[0].height, 4U);
  const RgbaImage decoded = decode_texture(texture.format, texture.levels[0].colour, 1024, 4);
  for (std::size_t i = 0; i < 256; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {  // at the middle of the pixel
      const std::size_t at = 4 * (1024 * 2 + 4 * i + 2) + c;
      EXPECT_NEAR(decoded.pixels[at], palette.pixels[4 * i + c], 8) << i;
    }
  }
}

TEST(BakeTexture, OnlySmallImagesThatBlocksCannotShowAreEnlarged) {
  const test::ScratchFolder folder;
  const auto width = [&folder](const RgbaImage& image, const TextureOptions& options = {}) {
    return bake(write_png(folder, image), options).levels[0].width;
  };
  EXPECT_EQ(width(pure_colours(64, 64)), 256U);
  EXPECT_EQ(width(pure_colours(64, 65)), 64U);
  const auto slope = [](std::uint32_t x, std::uint32_t y) {
    return std::array<std::uint32_t, 3>{4 * x, 4 * x, 4 * y / 8 + 2 * x};
  };
  EXPECT_EQ(width(test::paint(64, 64, slope)), 64U);
  TextureOptions options;
  options.max_side = 256;
  EXPECT_EQ(width(pure_colours(64, 1), options), 256U);
  options.max_side = 255;
  EXPECT_EQ(width(pure_colours(64, 1), options), 64U);
}

TEST(BakeTexture, AlphaHasATwinOnlyWhereItIsNotConstant) {
  const test::ScratchFolder folder;
  RgbaImage image = test::synthetic_photo(128, 64);
  EXPECT_FALSE(bake(write_png(folder, image), {}).alpha);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    image.pixels[i + 3] = static_cast<std::uint8_t>(i / 512 * 4);  // a row is 512 bytes
  }
  const Texture texture = bake(write_png(folder, image), {});
  EXPECT_TRUE(texture.alpha);
  for (const TextureLevel& level : texture.levels)
    ASSERT_EQ(level.alpha.size(), level.colour.size());
  const RgbaImage alpha = decode_texture(TextureFormat::kEtc1Rgb, texture.levels[0].alpha, 128, 64);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    EXPECT_NEAR(alpha.pixels[i], image.pixels[i + 3], 12);
    EXPECT_EQ(alpha.pixels[i], alpha.pixels[i + 2]);
  }
}

TEST(BakeTexture, ThreadsChangeNothing) {
  const test::ScratchFolder folder;
  const std::string path = write_png(folder, test::synthetic_photo(90, 70));
  TextureOptions options;
  const Texture one = bake(path, options);
  for (const unsigned jobs : {2U, 8U}) {
    options.jobs = jobs;
    const Texture many = bake(path, options);
    ASSERT_EQ(many.levels.size(), one.levels.size());
    for (std::size_t i = 0; i < one.levels.size(); ++i) {
      EXPECT_EQ(many.levels[i].colour, one.levels[i].colour);
      EXPECT_EQ(many.levels[i].psnr_db, one.levels[i].psnr_db);
    }
  }
}

TEST(Quality, HasTheValuesOfItsDefinition) {
  const RgbaImage a = test::synthetic_photo(40, 30);
  EXPECT_EQ(psnr_db(a, a), kEqualPsnr);
  EXPECT_DOUBLE_EQ(ssim(a, a), 1.0);
  RgbaImage b = a;
  for (std::size_t i = 0; i < b.pixels.size(); i += 4) {
    for (std::size_t c = 0; c < 3; ++c) {
      b.pixels[i + c] =
          static_cast<std::uint8_t>(b.pixels[i + c] + (b.pixels[i + c] < 128 ? 4 : -4));
    }
  }
  EXPECT_NEAR(psnr_db(a, b), 10 * std::log10(255.0 * 255.0 / 16), 1e-9);
  // Two flat images of 100 and 110: the formula leaves (2*100*110 + C1) / (100^2 + 110^2 + C1).
  const RgbaImage p = test::make_image(16, 16, 100);
  const RgbaImage q = test::make_image(16, 16, 110);
  EXPECT_NEAR(ssim(p, q), (2 * 100 * 110 + 6.5025) / (100 * 100 + 110 * 110 + 6.5025), 1e-6);
}

/// The share of a gray image's pixels that are 128 and more.
double covered_share(const RgbaImage& image) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4)
    count += image.pixels[i] >= 128 ? 1U : 0U;
  return 4.0 * static_cast<double>(count) / static_cast<double>(image.pixels.size());
}

TEST(BakeTexture, FoliageKeepsItsCoverageWithDistance) {
  // Small leaves here and there: filtered alone, few texels of a coarse level reach 1/2.
  RgbaImage leaves{128, 128, std::vector<std::uint8_t>(std::size_t{128} * 128 * 4, 90)};
  for (std::size_t i = 0; i < leaves.pixels.size(); i += 4) leaves.pixels[i + 3] = 0;
  std::uint32_t random = 12345;
  const auto place = [&random] { return (random = random * 1664525 + 1013904223) >> 25; };
  for (int leaf = 0; leaf < 220; ++leaf) {
    const std::size_t x = place();
    const std::size_t y = place();
    for (std::size_t i = 0; i < 20; ++i) {
      leaves.pixels[4 * ((y + i / 5) % 128 * 128 + (x + i % 5) % 128) + 3] = 255;
    }
  }
  double share = 0;
  for (std::size_t i = 3; i < leaves.pixels.size(); i += 4) share += leaves.pixels[i] / 255.0;
  share /= 128 * 128;
  const test::ScratchFolder folder;
  const Texture texture = bake(write_png(folder, leaves), {});
  ASSERT_TRUE(texture.cut_out);
  for (std::size_t level = 0; level < 5; ++level) {
    const TextureLevel& stored = texture.levels[level];
    const RgbaImage alpha =
        decode_texture(texture.format, stored.alpha, stored.width, stored.height);
    EXPECT_NEAR(covered_share(alpha), share, 0.1) << level;
  }
  // A tenth may be soft, between 1/10 and 9/10.
  for (const auto& [soft, alpha, cut] : std::initializer_list<std::array<int, 3>>{
           {25, 128, 1}, {26, 128, 0}, {26, 25, 1}, {26, 26, 0}, {26, 229, 0}, {26, 230, 1}}) {
    RgbaImage fence = test::synthetic_photo(16, 16);
    for (std::size_t i = 0; i < 256; ++i) {
      const bool rim = static_cast<int>(i) < soft;
      fence.pixels[4 * i + 3] = static_cast<std::uint8_t>(rim ? alpha : i < 128 ? 255 : 0);
    }
    EXPECT_EQ(bake(write_png(folder, fence), {}).cut_out, cut == 1) << soft << ' ' << alpha;
  }
  // A soft veil stays what it is.
  for (std::size_t i = 0; i < leaves.pixels.size(); i += 4) {
    leaves.pixels[i + 3] = static_cast<std::uint8_t>(i / 4 % 256);
  }
  EXPECT_FALSE(bake(write_png(folder, leaves), {}).cut_out);
  // So does a faint shadow in the middle of much nothing: no texel of it reaches 1/2.
  for (std::size_t i = 0; i < leaves.pixels.size(); i += 4) {
    const bool middle = i / 4 % 128 / 32 == 1 && i / 4 / 128 / 32 == 1;
    leaves.pixels[i + 3] = middle ? 100 : 0;
  }
  EXPECT_FALSE(bake(write_png(folder, leaves), {}).cut_out);
}

}  // namespace
}  // namespace modar
