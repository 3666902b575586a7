// The bits of one ETC1 block, packed by the tables of the extension's text: blocks of all kinds for
// the tests of encoder and decoder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace modar::test {

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

/// The block as GL reads it, most significant byte first.
void pack_etc1(const Etc1Block& block, std::span<std::byte, 8> out);

}  // namespace modar::test
