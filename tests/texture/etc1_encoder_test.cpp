// The encoder: exact where blocks can be exact, better than libetc1, the same for any thread count.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "bake/texture/texture_quality.hpp"
#include "tests/texture/libetc1.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

double quality(const RgbaImage& image) {
  return psnr_db(image, decode_etc1(encode_etc1(image), image.width, image.height));
}
double quality_of_libetc1(const RgbaImage& image) {
  return psnr_db(image, decode_etc1(test::libetc1_encode(image), image.width, image.height));
}

TEST(Etc1Encoder, BlocksThatTheFormatCanHoldComeBackAsTheyWere) {
  std::mt19937 random(5);
  std::vector<std::byte> blocks(std::size_t{256} * 8);
  for (std::byte& byte : blocks) byte = static_cast<std::byte>(random() & 0xff);
  for (std::size_t i = 3; i < blocks.size(); i += 8) blocks[i] &= std::byte{0xfd};  // individual
  const RgbaImage image = decode_etc1(blocks, 64, 64);
  EXPECT_GT(quality(image), quality_of_libetc1(image) + 1);
}

TEST(Etc1Encoder, FlatColoursAreOffByAtMostTwo) {
  std::mt19937 random(9);
  for (int i = 0; i < 300; ++i) {
    const std::array<unsigned long, 3> colour = {random() % 256, random() % 256, random() % 256};
    const RgbaImage image =
        test::paint(4, 4, [&colour](std::uint32_t, std::uint32_t) { return colour; });
    const RgbaImage decoded = decode_etc1(encode_etc1(image), 4, 4);
    for (std::size_t k = 0; k < 64; ++k) {
      EXPECT_LE(std::abs(int{decoded.pixels[k]} - int{image.pixels[k]}), 6)
          << colour[0] << " " << colour[1] << " " << colour[2];
    }
  }
}

TEST(Etc1Encoder, BlackWhiteAndTheirMixturesAreExact) {
  for (unsigned mask = 0; mask < 65536; mask += 257) {
    const RgbaImage image = test::paint(4, 4, [mask](std::uint32_t x, std::uint32_t y) {
      const unsigned value = (mask >> (4 * y + x) & 1) != 0 ? 255 : 0;
      return std::array<unsigned, 3>{value, value, value};
    });
    EXPECT_GT(quality(image), 25) << mask;
  }
  for (const std::uint8_t value : {std::uint8_t{0}, std::uint8_t{255}}) {
    RgbaImage image = test::make_image(8, 8, value);
    for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 255;
    EXPECT_EQ(decode_etc1(encode_etc1(image), 8, 8).pixels, image.pixels);
  }
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
  const auto files = test::files_of(test::shared_data() / "textures");
  if (files.empty()) GTEST_SKIP() << "no photos here";
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
  const RgbaImage image = test::synthetic_photo(129, 67);
  const std::vector<std::byte> blocks = encode_etc1(image, 1);
  EXPECT_EQ(encode_etc1(image, 2), blocks);
  EXPECT_EQ(encode_etc1(image, 8), blocks);
}

}  // namespace
}  // namespace modar
