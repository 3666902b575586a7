// Coverage, filling and flattening of atlases; sets of textures; the quality gate.
#include "bake/texture/coverage.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "bake/image/difference.hpp"
#include "bake/texture/texture_stage.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

using Triangle = std::array<std::array<double, 2>, 3>;

std::size_t count(const CoverageMask& mask) {
  return static_cast<std::size_t>(std::count(mask.covered.begin(), mask.covered.end(), 1));
}

TEST(Coverage, HasTheTexelsThatATriangleTouches) {
  CoverageMask mask = make_coverage(4, 4);
  // The lower left half: 10 of 16 texels are touched on or below the diagonal of texels.
  cover_triangle(mask, Triangle{{{0.01, 0.01}, {0.97, 0.01}, {0.01, 0.97}}});
  const std::vector<std::uint8_t> expected = {1, 0, 0, 0, 1, 1, 0, 0, 1, 1, 1, 0, 1, 1, 1, 1};
  EXPECT_EQ(mask.covered, expected);
  CoverageMask turned = make_coverage(4, 4);
  cover_triangle(turned, Triangle{{{0.01, 0.97}, {0.97, 0.01}, {0.01, 0.01}}});
  EXPECT_EQ(turned.covered, expected);
}

TEST(Coverage, WrapsAroundAndSurvivesNonsense) {
  CoverageMask mask = make_coverage(8, 8);
  cover_triangle(mask, Triangle{{{-0.1, 1.05}, {-0.01, 1.05}, {-0.1, 1.1}}});
  EXPECT_GT(count(mask), 0U);
  EXPECT_EQ(mask.covered[7 * 8 + 7], 1);  // u -0.05 is the last column, v 1.05 the lowest row
  CoverageMask all = make_coverage(8, 8);
  cover_triangle(all, Triangle{{{0, 0}, {std::nan(""), 0}, {0, 1}}});
  EXPECT_EQ(count(all), 64U);
  CoverageMask huge = make_coverage(8, 8);
  cover_triangle(huge, Triangle{{{0, 0}, {1e300, 0}, {0, 1e9}}});
  EXPECT_EQ(count(huge), 64U);
}

/// Whether a triangle and the unit square at (x, y) meet: the rest of the triangle when it is
/// clipped to the square (Sutherland and Hodgman, "Reentrant polygon clipping", 1974).
bool meets_square(const Triangle& corners, double x, double y) {
  std::vector<std::array<double, 2>> polygon(corners.begin(), corners.end());
  const std::array<std::array<double, 3>, 4> sides = {
      {{1, 0, -x}, {-1, 0, x + 1}, {0, 1, -y}, {0, -1, y + 1}}};
  for (const auto& [nx, ny, d] : sides) {
    std::vector<std::array<double, 2>> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const auto& p = polygon[i];
      const auto& q = polygon[(i + 1) % polygon.size()];
      const double at_p = nx * p[0] + ny * p[1] + d;
      const double at_q = nx * q[0] + ny * q[1] + d;
      if (at_p >= 0) kept.push_back(p);
      if ((at_p >= 0) != (at_q >= 0)) {
        const double t = at_p / (at_p - at_q);
        kept.push_back({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])});
      }
    }
    polygon = kept;
  }
  return !polygon.empty();
}

TEST(Coverage, IsWhatClippingFindsForTrianglesThatWrapAround) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.5, 1.5);
  constexpr std::uint32_t kWidth = 16;
  constexpr std::uint32_t kHeight = 8;
  for (int round = 0; round < 60; ++round) {
    const double size = round % 3 == 0 ? 0.1 : 1;
    const std::array<double, 2> at = {uniform(random), uniform(random)};
    Triangle uv{};
    Triangle texels{};
    for (std::size_t i = 0; i < 3; ++i) {
      uv[i] = {at[0] + size * uniform(random), at[1] + size * uniform(random)};
      texels[i] = {uv[i][0] * kWidth, (1 - uv[i][1]) * kHeight};
    }
    CoverageMask mask = make_coverage(kWidth, kHeight);
    cover_triangle(mask, uv);
    CoverageMask expected = make_coverage(kWidth, kHeight);
    for (int y = -40; y < 48; ++y) {
      for (int x = -64; x < 80; ++x) {
        if (!meets_square(texels, x, y)) continue;
        expected.covered[static_cast<std::size_t>((y + 40) % 8 * 16 + (x + 64) % 16)] = 1;
      }
    }
    EXPECT_EQ(mask.covered, expected.covered) << round;
  }
}

TEST(Coverage, IsFullOnceATriangleHoldsAWholeRepeat) {
  CoverageMask floor = make_coverage(1024, 1024);
  cover_triangle(floor, Triangle{{{0, 0}, {24, 0}, {24, 24}}});
  EXPECT_TRUE(floor.full);
  EXPECT_EQ(count(floor), floor.covered.size());
  // Half of a repeat, twice: found full by looking, once as many texels were marked as there are.
  CoverageMask tile = make_coverage(64, 64);
  cover_triangle(tile, Triangle{{{0, 0}, {1, 0}, {1, 1}}});
  EXPECT_FALSE(tile.full);
  cover_triangle(tile, Triangle{{{0, 0}, {1, 1}, {0, 1}}});
  EXPECT_TRUE(tile.full);
  // A strip of one column's width along 9 repeats shows that column alone, and its neighbours.
  CoverageMask strip = make_coverage(64, 64);
  cover_triangle(strip, Triangle{{{0.501, 0}, {0.502, 0}, {0.501, 9}}});
  EXPECT_EQ(count(strip), 64U);
}

TEST(Coverage, ResizingLosesNothing) {
  CoverageMask mask = make_coverage(9, 5);
  mask.covered[9 * 4 + 8] = 1;
  const CoverageMask small = resize_coverage(mask, 2, 2);
  EXPECT_EQ(small.covered, (std::vector<std::uint8_t>{0, 0, 0, 1}));
  const CoverageMask large = resize_coverage(mask, 18, 10);
  EXPECT_EQ(count(large), 4U);
}

/// Red left of the middle, garbage right of it, and the mask of the red.
RgbaImage half_red(std::uint32_t side, CoverageMask& mask) {
  RgbaImage image = test::noise(side, side, 4);
  mask = make_coverage(side, side);
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side / 2; ++x) {
      const std::size_t i = std::size_t{y} * side + x;
      mask.covered[i] = 1;
      const std::uint8_t red[4] = {static_cast<std::uint8_t>(180 + x % 2), 20, 10, 255};
      std::copy(red, red + 4, &image.pixels[4 * i]);
    }
  }
  return image;
}

TEST(Atlas, NothingUncoveredShowsAtAnyLevel) {
  const test::ScratchFolder folder;
  CoverageMask mask;
  const RgbaImage image = half_red(64, mask);
  ASSERT_TRUE(write_png(image, folder.file("atlas.png")));
  TextureOptions options;
  options.coverage = &mask;
  Report report;
  const Result<Texture> texture = bake_texture(folder.file("atlas.png"), options, report);
  ASSERT_TRUE(texture) << to_line(texture.error());
  ASSERT_EQ(texture->levels.size(), 7U);
  for (const TextureLevel& level : texture->levels) {
    const RgbaImage decoded =
        decode_texture(TextureFormat::kEtc1Rgb, level.colour, level.width, level.height);
    for (std::size_t i = 0; i < decoded.pixels.size(); i += 4) {
      EXPECT_NEAR(decoded.pixels[i], 180, 8) << level.width;
      EXPECT_NEAR(decoded.pixels[i + 1], 20, 8) << level.width;
    }
  }
  // Of each row of 16 blocks, those from the tenth on are more than a texel away from the red: one
  // pattern of bits for all of them.
  std::set<std::vector<std::byte>> distinct;
  const std::vector<std::byte>& blocks = texture->levels[0].colour;
  for (std::size_t block = 0; block < 256; ++block) {
    if (block % 16 < 9) continue;
    distinct.insert({blocks.begin() + static_cast<std::ptrdiff_t>(8 * block),
                     blocks.begin() + static_cast<std::ptrdiff_t>(8 * block + 8)});
  }
  EXPECT_EQ(distinct.size(), 1U);
}

TEST(Atlas, ConstantTexturesBecomeOneTexel) {
  const test::ScratchFolder folder;
  CoverageMask mask;
  RgbaImage image = half_red(32, mask);
  for (std::size_t i = 0; i < mask.covered.size(); ++i) {
    if (mask.covered[i] != 0) image.pixels[4 * i] = 180;
  }
  ASSERT_TRUE(write_png(image, folder.file("flat.png")));
  TextureOptions options;
  options.coverage = &mask;
  Report report;
  const Result<Texture> texture = bake_texture(folder.file("flat.png"), options, report);
  ASSERT_TRUE(texture);
  EXPECT_TRUE(texture->constant);
  EXPECT_EQ(texture->constant_rgba, (std::array<std::uint8_t, 4>{180, 20, 10, 255}));
  ASSERT_EQ(texture->levels.size(), 1U);
  EXPECT_EQ(texture->levels[0].width, 1U);
  EXPECT_EQ(texture->levels[0].colour.size(), 8U);
}

TEST(Atlas, EmptyMaskChangesNothing) {
  RgbaImage image = test::noise(16, 16, 8);
  const std::vector<std::uint8_t> before = image.pixels;
  fill_uncovered(image, make_coverage(16, 16));
  flatten_uncovered_blocks(image, make_coverage(16, 16));
  EXPECT_EQ(image.pixels, before);
}

TEST(CutOut, HiddenColoursReachNoLevel) {
  // A green leaf on magenta of alpha 0, as painting programs leave it.
  constexpr std::uint32_t kSide = 64;
  RgbaImage image = test::paint(kSide, kSide, [](std::uint32_t, std::uint32_t) {
    return std::array<int, 3>{255, 0, 255};
  });
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      std::uint8_t* pixel = &image.pixels[(std::size_t{y} * kSide + x) * 4];
      pixel[3] = 0;
      if (std::hypot(x - 31.5, y - 31.5) > 20) continue;
      const std::uint8_t leaf[4] = {40, static_cast<std::uint8_t>(140 + x % 8), 30, 255};
      std::copy_n(leaf, 4, pixel);
    }
  }
  const test::ScratchFolder folder;
  ASSERT_TRUE(write_png(image, folder.file("leaf.png")));
  Report report;
  const Result<Texture> texture = bake_texture(folder.file("leaf.png"), {}, report);
  ASSERT_TRUE(texture) << to_line(texture.error());
  EXPECT_TRUE(texture->alpha);
  for (const TextureLevel& level : texture->levels) {
    const RgbaImage colours =
        decode_texture(TextureFormat::kEtc1Rgb, level.colour, level.width, level.height);
    for (std::size_t i = 0; i < colours.pixels.size(); i += 4) {
      EXPECT_NEAR(colours.pixels[i], 40, 12) << level.width;
      EXPECT_NEAR(colours.pixels[i + 2], 30, 12) << level.width;
    }
  }
}

TEST(CutOut, AnImageWithoutVisibleTexelsStaysAsItIs) {
  RgbaImage image = test::noise(8, 8, 8);
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 0;
  const std::vector<std::uint8_t> before = image.pixels;
  fill_transparent(image);
  EXPECT_EQ(image.pixels, before);
}

TEST(TextureSet, FindsIdenticalTextures) {
  const test::ScratchFolder folder;
  std::vector<Texture> textures;
  for (const auto& [name, seed] : {std::pair{"a.png", 1U}, {"b.png", 2U}, {"c.png", 1U}}) {
    ASSERT_TRUE(write_png(test::synthetic_photo(16, 16, seed), folder.file(name)));
    Report report;
    textures.push_back(*bake_texture(folder.file(name), {}, report));
  }
  textures.push_back(textures[0]);
  textures.back().wrap = kTextureRepeat;
  EXPECT_EQ(first_identical(textures), (std::vector<std::size_t>{0, 1, 0, 3}));
}

TEST(TextureSet, PlansWithinABudget) {
  const std::vector<TexturePlan> plans = {{1000, 1000, false}, {512, 256, true}};
  // 1024x1024 and 2 x 512x256 at half a byte a pixel, with a third more for the mips.
  TextureOptions options;
  EXPECT_NEAR(static_cast<double>(planned_bytes(plans, options)),
              (1024.0 * 1024 + 2 * 512 * 256) / 2 * 4 / 3, 200);
  EXPECT_EQ(plan_max_side(plans, options, 1 << 30), 2048U);
  EXPECT_EQ(plan_max_side(plans, options, 400000), 512U);
  EXPECT_EQ(plan_max_side(plans, options, 0), 1U);
  options.max_side = 512;
  Report report;
  EXPECT_EQ(planned_bytes(std::vector<TexturePlan>{{4, 4, false}}, options), 8U * 3);
}

TEST(QualityGate, NamesTheWorstBlockAndDrawsAPicture) {
  const test::ScratchFolder folder;
  RgbaImage image = test::synthetic_photo(128, 64);
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    image.pixels[i] = image.pixels[i + 1] = image.pixels[i + 2] = 90;
  }
  const RgbaImage grains = test::noise(4, 4, 2);
  for (std::size_t y = 0; y < 4; ++y) {
    std::copy_n(&grains.pixels[y * 16], 16, &image.pixels[((8 + y) * 128 + 20) * 4]);
  }
  ASSERT_TRUE(write_png(image, folder.file("spot.png")));
  TextureOptions options;
  options.min_psnr_db = 60;
  options.picture_folder = folder.file("");
  Report report;
  const Result<Texture> texture = bake_texture(folder.file("spot.png"), options, report);
  ASSERT_TRUE(texture) << to_line(texture.error());
  ASSERT_EQ(report.diagnostics.size(), 1U);
  EXPECT_EQ(report.diagnostics[0].id, "texture.quality");
  EXPECT_NE(report.diagnostics[0].message.find("20,8"), std::string::npos);
  const Result<RgbaImage> picture = read_image(folder.file("spot.png.png"));
  ASSERT_TRUE(picture) << to_line(picture.error());
  EXPECT_EQ(picture->width, 384U);
  EXPECT_EQ(picture->height, 64U);
  EXPECT_EQ(picture->pixels[0], 90);
  options.min_psnr_db = 5;
  Report quiet;
  ASSERT_TRUE(bake_texture(folder.file("spot.png"), options, quiet));
  EXPECT_TRUE(quiet.diagnostics.empty());
}

}  // namespace
}  // namespace modar
