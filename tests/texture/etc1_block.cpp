// Packs ETC1 blocks.
#include "tests/texture/etc1_block.hpp"

namespace modar::test {

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

}  // namespace modar::test
