// ETC1 blocks to pixels.
#include "formats/etc1.hpp"

#include <algorithm>
#include <array>

namespace modar {
namespace {

struct Block {
  std::array<std::array<int, 3>, 2> base{};  ///< 8-bit colours of the two halves
  std::array<std::size_t, 2> table{};
  bool flipped = false;  ///< halves are one above the other
  std::uint32_t indices = 0;
};

Block read_block(const std::byte* bytes) {
  const auto at = [&](int i) { return std::to_integer<int>(bytes[i]); };
  Block block;
  const bool differential = (at(3) & 2) != 0;
  for (int c = 0; c < 3; ++c) {
    const std::size_t channel = static_cast<std::size_t>(c);
    if (differential) {
      const int first = at(c) >> 3;
      const int step = (at(c) & 7) - ((at(c) & 4) << 1);
      block.base[0][channel] = etc1_expand5(first);
      // Beyond 5 bits the format leaves the result open: wrapped, as the bits would be.
      block.base[1][channel] = etc1_expand5((first + step) & 31);
    } else {
      block.base[0][channel] = etc1_expand4(at(c) >> 4);
      block.base[1][channel] = etc1_expand4(at(c) & 15);
    }
  }
  block.table = {static_cast<std::size_t>(at(3) >> 5), static_cast<std::size_t>(at(3) >> 2 & 7)};
  block.flipped = (at(3) & 1) != 0;
  block.indices = static_cast<std::uint32_t>(at(4)) << 24 |
                  static_cast<std::uint32_t>(at(5)) << 16 | static_cast<std::uint32_t>(at(6)) << 8 |
                  static_cast<std::uint32_t>(at(7));
  return block;
}

/// x, y: 0-3 inside the block. Pixels are numbered column by column.
void write_pixel(const Block& block, std::uint32_t x, std::uint32_t y, std::uint8_t* rgb) {
  const std::uint32_t pixel = x * 4 + y;
  const std::size_t half = (block.flipped ? y : x) >= 2 ? 1 : 0;
  const bool large = (block.indices >> pixel & 1) != 0;
  const bool negative = (block.indices >> (pixel + 16) & 1) != 0;
  const int step = kEtc1Modifiers[block.table[half]][large ? 1 : 0];
  for (std::size_t c = 0; c < 3; ++c) {
    const int value = block.base[half][c] + (negative ? -step : step);
    rgb[c] = static_cast<std::uint8_t>(std::clamp(value, 0, 255));
  }
}

}  // namespace

void decode_etc1(std::span<const std::byte> blocks, std::uint32_t width, std::uint32_t height,
                 std::size_t pixel_bytes, std::span<std::uint8_t> pixels) {
  const std::uint32_t columns = (width + 3) / 4;
  for (std::uint32_t top = 0; top < height; top += 4) {
    for (std::uint32_t left = 0; left < width; left += 4) {
      const std::size_t index = std::size_t{top / 4} * columns + left / 4;
      if ((index + 1) * 8 > blocks.size()) return;
      const Block block = read_block(blocks.data() + index * 8);
      for (std::uint32_t y = 0; y < std::min(4u, height - top); ++y) {
        for (std::uint32_t x = 0; x < std::min(4u, width - left); ++x) {
          write_pixel(block, x, y,
                      &pixels[(std::size_t{top + y} * width + left + x) * pixel_bytes]);
        }
      }
    }
  }
}

}  // namespace modar
