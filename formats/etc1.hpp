// ETC1 blocks: their numbers and their pixels.
// Source: GL_OES_compressed_ETC1_RGB8_texture, the extension's text.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace modar {

/// Table 3.17.2: what each of the two code words of a table adds to the base colour; the other two
/// are their negatives.
inline constexpr std::array<std::array<int, 2>, 8> kEtc1Modifiers = {
    {{2, 8}, {5, 17}, {9, 29}, {13, 42}, {18, 60}, {24, 80}, {33, 106}, {47, 183}}};

/// Quantised base colours as 8 bits: the top bits are repeated below.
constexpr int etc1_expand4(int value) {
  return value << 4 | value;
}
constexpr int etc1_expand5(int value) {
  return value << 3 | value >> 2;
}

/// Decodes blocks of 8 bytes and 4x4 pixels, in rows of ceil(width/4). pixels: top row first, each
/// of pixel_bytes (3 or 4), of which red, green and blue are written. Stops where blocks end.
void decode_etc1(std::span<const std::byte> blocks, std::uint32_t width, std::uint32_t height,
                 std::size_t pixel_bytes, std::span<std::uint8_t> pixels);

}  // namespace modar
