// ETC1 blocks to pixels, and the packing of a block's bits.
#include <algorithm>

#include "bake/texture/etc1/etc1_block.hpp"
#include "bake/texture/texture.hpp"

namespace modar {
namespace {

int sign3(unsigned bits) {
  return bits >= 4 ? static_cast<int>(bits) - 8 : static_cast<int>(bits);
}

std::uint64_t read_big_endian(std::span<const std::byte, 8> bytes) {
  std::uint64_t word = 0;
  for (const std::byte byte : bytes) word = word << 8 | std::to_integer<std::uint64_t>(byte);
  return word;
}

}  // namespace

void pack_etc1(const Etc1Block& block, std::span<std::byte, 8> out) {
  std::uint64_t word = 0;
  const auto put = [&word](int value, unsigned bit) {
    word |= static_cast<std::uint64_t>(static_cast<unsigned>(value)) << bit;
  };
  for (unsigned channel = 0; channel < 3; ++channel) {
    const int first = block.base[0][channel];
    const int second = block.base[1][channel];
    if (block.differential) {
      put(first, 59 - 8 * channel);
      put((second - first) & 7, 56 - 8 * channel);
    } else {
      put(first, 60 - 8 * channel);
      put(second, 56 - 8 * channel);
    }
  }
  put(block.table[0], 37);
  put(block.table[1], 34);
  put(block.differential ? 1 : 0, 33);
  put(block.flip ? 1 : 0, 32);
  for (unsigned x = 0; x < 4; ++x) {
    for (unsigned y = 0; y < 4; ++y) {
      const int code = block.code[4 * y + x];
      put(code >> 1, 16 + 4 * x + y);
      put(code & 1, 4 * x + y);
    }
  }
  for (std::size_t i = 0; i < 8; ++i) out[i] = static_cast<std::byte>(word >> (56 - 8 * i) & 0xff);
}

Etc1Block unpack_etc1(std::span<const std::byte, 8> bytes) {
  const std::uint64_t word = read_big_endian(bytes);
  const auto bits = [word](unsigned bit, unsigned count) {
    return static_cast<unsigned>(word >> bit & ((1U << count) - 1));
  };
  Etc1Block block;
  block.differential = bits(33, 1) != 0;
  block.flip = bits(32, 1) != 0;
  block.table = {static_cast<int>(bits(37, 3)), static_cast<int>(bits(34, 3))};
  for (unsigned channel = 0; channel < 3; ++channel) {
    if (block.differential) {
      block.base[0][channel] = static_cast<int>(bits(59 - 8 * channel, 5));
      block.base[1][channel] = (block.base[0][channel] + sign3(bits(56 - 8 * channel, 3))) & 31;
    } else {
      block.base[0][channel] = static_cast<int>(bits(60 - 8 * channel, 4));
      block.base[1][channel] = static_cast<int>(bits(56 - 8 * channel, 4));
    }
  }
  for (unsigned x = 0; x < 4; ++x) {
    for (unsigned y = 0; y < 4; ++y) {
      const unsigned pixel = 4 * x + y;
      block.code[4 * y + x] = static_cast<std::uint8_t>(bits(16 + pixel, 1) << 1 | bits(pixel, 1));
    }
  }
  return block;
}

RgbaImage decode_etc1(std::span<const std::byte> blocks, std::uint32_t width,
                      std::uint32_t height) {
  RgbaImage image{width, height, {}};
  image.pixels.assign(std::size_t{width} * height * 4, 255);
  const std::size_t columns = (std::size_t{width} + 3) / 4;
  for (std::size_t top = 0; top < height; top += 4) {
    for (std::size_t left = 0; left < width; left += 4) {
      const std::size_t index = top / 4 * columns + left / 4;
      if ((index + 1) * 8 > blocks.size()) return image;
      const Etc1Block block = unpack_etc1(blocks.subspan(index * 8).first<8>());
      for (std::size_t y = 0; y < 4 && top + y < height; ++y) {
        for (std::size_t x = 0; x < 4 && left + x < width; ++x) {
          const std::size_t half = etc1_half(block.flip, x, y);
          const int add = etc1_modifier(block.table[half], block.code[4 * y + x]);
          std::uint8_t* out = &image.pixels[((top + y) * width + left + x) * 4];
          for (std::size_t channel = 0; channel < 3; ++channel) {
            const int base = block.base[half][channel];
            const int wide = block.differential ? etc1_expand5(base) : etc1_expand4(base);
            out[channel] = static_cast<std::uint8_t>(std::clamp(wide + add, 0, 255));
          }
        }
      }
    }
  }
  return image;
}

}  // namespace modar
