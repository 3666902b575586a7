// Mip levels: sizes, linear light, alpha.
#include <gtest/gtest.h>

#include <array>

#include "bake/image/resample.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

TEST(MipChain, GoesDownToOnePixelByHalves) {
  const std::vector<RgbaImage> levels = mip_chain(test::noise(20, 7, 1));
  const std::vector<std::array<std::uint32_t, 2>> sizes = {
      {20, 7}, {10, 3}, {5, 1}, {2, 1}, {1, 1}};
  ASSERT_EQ(levels.size(), sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    EXPECT_EQ(levels[i].width, sizes[i][0]);
    EXPECT_EQ(levels[i].height, sizes[i][1]);
    EXPECT_EQ(levels[i].pixels.size(), std::size_t{sizes[i][0]} * sizes[i][1] * 4);
  }
}

TEST(MipChain, AveragesLightAndNotCodes) {
  // Half of full light is sRGB 188, not 128 (IEC 61966-2-1).
  const RgbaImage board = test::paint(16, 16, [](std::uint32_t x, std::uint32_t y) {
    const int value = (x + y) % 2 == 0 ? 255 : 0;
    return std::array<int, 3>{value, value, value};
  });
  const std::vector<RgbaImage> levels = mip_chain(board, kWrapRepeat);
  for (std::size_t level = 1; level < levels.size(); ++level) {
    for (std::size_t i = 0; i < levels[level].pixels.size(); i += 4) {
      EXPECT_NEAR(levels[level].pixels[i], 188, 1) << "level " << level;
    }
  }
}

TEST(MipChain, FlatImagesStayAsTheyAre) {
  for (const int value : {0, 1, 77, 254, 255}) {
    const RgbaImage flat = test::paint(24, 10, [value](std::uint32_t, std::uint32_t) {
      return std::array<int, 3>{value, 9, 200};
    });
    for (const RgbaImage& level : mip_chain(flat)) {
      EXPECT_EQ(level.pixels[0], value);
      EXPECT_EQ(level.pixels[1], 9);
      EXPECT_EQ(level.pixels[2], 200);
      EXPECT_EQ(level.pixels[3], 255);
    }
  }
}

TEST(MipChain, TransparentPixelsLendNoColour) {
  RgbaImage image = test::paint(16, 16, [](std::uint32_t x, std::uint32_t) {
    return x % 4 < 2 ? std::array<int, 3>{200, 40, 60} : std::array<int, 3>{0, 255, 0};
  });
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    if (image.pixels[i + 1] == 255) image.pixels[i + 3] = 0;
  }
  const std::vector<RgbaImage> levels = mip_chain(image, kWrapRepeat);
  for (std::size_t level = 1; level < levels.size(); ++level) {
    for (std::size_t i = 0; i < levels[level].pixels.size(); i += 4) {
      if (levels[level].pixels[i + 3] < 8) continue;
      EXPECT_NEAR(levels[level].pixels[i], 200, 3) << "level " << level;
      EXPECT_NEAR(levels[level].pixels[i + 1], 40, 6) << "level " << level;
    }
  }
  EXPECT_NEAR(levels.back().pixels[3], 128, 1);
}

TEST(MipChain, ThreadsChangeNothing) {
  const RgbaImage image = test::synthetic_photo(101, 64);
  const std::vector<RgbaImage> one = mip_chain(image, {}, 1);
  const std::vector<RgbaImage> eight = mip_chain(image, {}, 8);
  ASSERT_EQ(one.size(), eight.size());
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].pixels, eight[i].pixels);
}

TEST(MipChain, RepeatReachesAcrossTheEdge) {
  for (const std::uint32_t side : {8u, 128u}) {
    const RgbaImage image = test::paint(side, side, [side](std::uint32_t x, std::uint32_t y) {
      return std::array<int, 3>{x == side - 1 ? 255 : 0, y == 0 ? 255 : 0, 0};
    });
    // The first column and the last row of the half are next to the light only where it repeats.
    const std::size_t last = std::size_t{side / 2} * (side / 2 - 1) * 4;
    const RgbaImage clamped = mip_chain(image)[1];
    EXPECT_EQ(clamped.pixels[last], 0) << side;
    EXPECT_EQ(clamped.pixels[last + 1], 0) << side;
    const RgbaImage repeated = mip_chain(image, kWrapRepeat)[1];
    EXPECT_GT(repeated.pixels[last], 10) << side;
    EXPECT_GT(repeated.pixels[last + 1], 10) << side;
    const RgbaImage across = mip_chain(image, {Wrap::kRepeat, Wrap::kMirror})[1];
    EXPECT_GT(across.pixels[last], 10) << side;
    EXPECT_EQ(across.pixels[last + 1], 0) << side;
  }
}

TEST(Resize, IsTheSameInBandsAsInOnePiece) {
  for (const bool opaque : {true, false}) {
    RgbaImage image = test::noise(61, 83, 5);
    for (std::size_t i = 3; i < image.pixels.size() && !opaque; i += 4) {
      image.pixels[i] = static_cast<std::uint8_t>(i % 256);
    }
    for (const TextureWrap& wrap : {TextureWrap{}, kWrapRepeat}) {
      for (const auto& [width, height] : {std::pair{16U, 32U}, {128U, 64U}, {61U, 1U}}) {
        const ResampleOptions options = {wrap, 2};
        const RgbaImage whole = to_srgb(resample(to_linear(image), width, height, options));
        EXPECT_EQ(resize(image, width, height, options).pixels, whole.pixels) << width;
      }
    }
  }
}

}  // namespace
}  // namespace modar
