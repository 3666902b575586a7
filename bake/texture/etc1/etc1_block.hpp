// The bits of one ETC1 block: packing, unpacking, the table of modifiers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace modar {

/// GL_OES_compressed_ETC1_RGB8_texture, table 3.17.2: what each of the two code words of a table
/// adds to the base colour; the other two are their negatives.
inline constexpr std::array<std::array<int, 2>, 8> kEtc1Modifiers = {
    {{2, 8}, {5, 17}, {9, 29}, {13, 42}, {18, 60}, {24, 80}, {33, 106}, {47, 183}}};

/// Pixels of a block are counted in rows: pixel(x, y) = 4 * y + x.
struct Etc1Block {
  bool differential = false;
  bool flip = false;  ///< false: two halves of 2x4, side by side; true: 4x2, one above the other
  /// Quantised base colours [half][channel]: 0-15, or 0-31 where differential (the second then
  /// differs from the first by -4 to 3 in each channel).
  std::array<std::array<int, 3>, 2> base{};
  std::array<int, 2> table{};           ///< 0-7
  std::array<std::uint8_t, 16> code{};  ///< 0: +small, 1: +large, 2: -small, 3: -large
};

/// Which half of the block pixel (x, y) belongs to.
constexpr std::size_t etc1_half(bool flip, std::size_t x, std::size_t y) {
  return (flip ? y : x) / 2;
}
/// Base colours as 8 bits, the top bits repeated below.
constexpr int etc1_expand4(int value) {
  return value * 17;
}
constexpr int etc1_expand5(int value) {
  return (value << 3) | (value >> 2);
}
/// What a code adds to each channel of the base colour.
constexpr int etc1_modifier(int table, int code) {
  const int size =
      kEtc1Modifiers[static_cast<std::size_t>(table)][static_cast<std::size_t>(code & 1)];
  return code >= 2 ? -size : size;
}

/// The block as GL reads it, most significant byte first.
void pack_etc1(const Etc1Block& block, std::span<std::byte, 8> out);
/// Its inverse. The second colour of a differential block that leaves 0-31 wraps around, as in
/// Android's decoder: the extension leaves it undefined, and we write no such block.
Etc1Block unpack_etc1(std::span<const std::byte, 8> bytes);

}  // namespace modar
