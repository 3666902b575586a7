// Android's libetc1, seen through our image type.
#include "tests/texture/libetc1.hpp"

#include <android/ETC1/etc1.h>

#include <array>

namespace modar::test {

RgbaImage libetc1_decode(std::span<const std::byte> blocks, std::uint32_t width,
                         std::uint32_t height) {
  RgbaImage image{width, height, std::vector<std::uint8_t>(std::size_t{width} * height * 4, 255)};
  for (std::size_t block = 0; block < blocks.size() / 8; ++block) {
    std::array<etc1_byte, ETC1_DECODED_BLOCK_SIZE> pixels{};
    etc1_decode_block(reinterpret_cast<const etc1_byte*>(&blocks[block * 8]), pixels.data());
    const std::size_t left = block % (width / 4) * 4;
    const std::size_t top = block / (width / 4) * 4;
    for (std::size_t i = 0; i < 48; ++i) {
      const std::size_t pixel = i / 3;
      image.pixels[((top + pixel / 4) * width + left + pixel % 4) * 4 + i % 3] = pixels[i];
    }
  }
  return image;
}

std::vector<std::byte> libetc1_encode(const RgbaImage& image) {
  std::vector<etc1_byte> rgb;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (i % 4 != 3) rgb.push_back(image.pixels[i]);
  }
  std::vector<std::byte> blocks(etc1_get_encoded_data_size(image.width, image.height));
  etc1_encode_image(rgb.data(), image.width, image.height, 3, image.width * 3,
                    reinterpret_cast<etc1_byte*>(blocks.data()));
  return blocks;
}

}  // namespace modar::test
