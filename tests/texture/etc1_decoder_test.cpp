// The decoder and the packing of bits, held against Android's libetc1 and etc1tool.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "bake/export/texture_files.hpp"
#include "bake/texture/etc1/etc1_encoder.hpp"
#include "tests/texture/etc1_block.hpp"
#include "tests/texture/libetc1.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

std::vector<std::byte> random_bytes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes(count);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random() & 0xff);
  return bytes;
}

TEST(Etc1Decoder, AgreesWithLibetc1OnRandomBlocks) {
  const std::vector<std::byte> blocks = random_bytes(std::size_t{64} * 64 * 8, 7);
  EXPECT_EQ(decode_texture(TextureFormat::kEtc1Rgb, blocks, 256, 256).pixels,
            test::libetc1_decode(blocks, 256, 256).pixels);
}

TEST(Etc1Decoder, AgreesWithLibetc1OnEveryTableModeAndFlip) {
  std::vector<std::byte> blocks;
  for (int corner = 0; corner < 4; ++corner) {
    for (int table = 0; table < 64; ++table) {
      for (int mode = 0; mode < 4; ++mode) {
        test::Etc1Block block;
        block.differential = mode % 2 != 0;
        block.flip = mode / 2 != 0;
        block.table = {table % 8, table / 8};
        const int top = block.differential ? 31 : 15;
        block.base[0] = {corner % 2 * top, corner / 2 * top, 7};
        block.base[1] = block.base[0];
        for (std::size_t i = 0; i < 16; ++i) block.code[i] = static_cast<std::uint8_t>(i % 4);
        std::array<std::byte, 8> bytes{};
        test::pack_etc1(block, bytes);
        blocks.insert(blocks.end(), bytes.begin(), bytes.end());
      }
    }
  }
  EXPECT_EQ(decode_texture(TextureFormat::kEtc1Rgb, blocks, 128, 128).pixels,
            test::libetc1_decode(blocks, 128, 128).pixels);
}

TEST(Etc1Decoder, CropsToTheImage) {
  const std::vector<std::byte> blocks = random_bytes(4 * 8, 3);
  const RgbaImage whole = decode_texture(TextureFormat::kEtc1Rgb, blocks, 8, 8);
  const RgbaImage part = decode_texture(TextureFormat::kEtc1Rgb, blocks, 5, 7);
  ASSERT_EQ(part.pixels.size(), 5U * 7U * 4U);
  for (std::size_t y = 0; y < 7; ++y) {
    for (std::size_t i = 0; i < 20; ++i) {
      EXPECT_EQ(part.pixels[y * 20 + i], whole.pixels[y * 32 + i]);
    }
  }
}

TEST(Etc1Decoder, ToleratesTooFewBlocks) {
  const std::vector<std::byte> blocks = random_bytes(8, 3);
  EXPECT_EQ(decode_texture(TextureFormat::kEtc1Rgb, blocks, 64, 64).pixels.size(), 64U * 64U * 4U);
}

TEST(TextureFiles, Etc1toolReadsOurPkm) {
  if (std::system("command -v etc1tool > /dev/null") != 0) GTEST_SKIP() << "no etc1tool";
  const test::ScratchFolder folder;
  const RgbaImage image = test::synthetic_photo(37, 22);
  const std::vector<std::byte> blocks = encode_etc1(image);
  test::write_file(folder.file("a.pkm"), to_pkm(blocks, image.width, image.height));
  const std::string command =
      "etc1tool --decode " + folder.file("a.pkm") + " -o " + folder.file("a.png");
  ASSERT_EQ(std::system(command.c_str()), 0);
  const Result<RgbaImage> decoded = read_image(folder.file("a.png"));
  ASSERT_TRUE(decoded) << to_line(decoded.error());
  EXPECT_EQ(decoded->width, 37U);
  EXPECT_EQ(decoded->height, 22U);
  EXPECT_EQ(decoded->pixels, decode_texture(TextureFormat::kEtc1Rgb, blocks, 37, 22).pixels);
}

TEST(TextureFiles, KtxHasTheFieldsOfItsSpecification) {
  const std::vector<std::byte> large = random_bytes(32, 1);
  const std::vector<std::byte> small = random_bytes(8, 2);
  const std::array<KtxLevel, 2> levels = {{{8, 8, large}, {4, 4, small}}};
  const std::vector<std::byte> file = to_ktx(TextureFormat::kEtc1Rgb, levels);
  ASSERT_EQ(file.size(), 64U + 4 + 32 + 4 + 8);
  const auto word = [&file](std::size_t at) {
    return std::to_integer<unsigned>(file[at]) | std::to_integer<unsigned>(file[at + 1]) << 8 |
           std::to_integer<unsigned>(file[at + 2]) << 16 |
           std::to_integer<unsigned>(file[at + 3]) << 24;
  };
  const std::array<unsigned, 12> identifier = {0xAB, 'K',  'T',  'X',  ' ',  '1',
                                               '1',  0xBB, '\r', '\n', 0x1A, '\n'};
  for (std::size_t i = 0; i < identifier.size(); ++i) {
    EXPECT_EQ(std::to_integer<unsigned>(file[i]), identifier[i]);
  }
  const std::array<unsigned, 13> header = {0x04030201, 0, 1, 0, 0x8D64, 0x1907, 8,
                                           8,          0, 0, 1, 2,      0};
  for (std::size_t i = 0; i < header.size(); ++i) EXPECT_EQ(word(12 + 4 * i), header[i]);
  EXPECT_EQ(word(64), 32U);
  EXPECT_EQ(word(100), 8U);
  EXPECT_TRUE(std::equal(small.begin(), small.end(), file.begin() + 104));
}

}  // namespace
}  // namespace modar
