// Blocks of one colour: for each modifier the nearest base colour is known beforehand.
#include "bake/texture/etc1/etc1_solid.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>

#include "bake/texture/etc1/etc1_block.hpp"

namespace modar {
namespace {

constexpr std::size_t kModifiers = 32;  // table * 4 + code

/// For a mode (0: 4 bits, 1: 5 bits), a modifier and a value: the best base and how far it is off.
struct SolidTable {
  std::uint8_t base[2][kModifiers][256]{};
  std::uint8_t miss[2][kModifiers][256]{};

  SolidTable() {
    for (std::size_t mode = 0; mode < 2; ++mode) {
      for (std::size_t modifier = 0; modifier < kModifiers; ++modifier) fill(mode, modifier);
    }
  }

 private:
  void fill(std::size_t mode, std::size_t modifier) {
    const int add = etc1_modifier(static_cast<int>(modifier / 4), static_cast<int>(modifier % 4));
    for (int value = 0; value < 256; ++value) {
      int best = 256;
      int best_base = 0;
      for (int q = 0; q < (mode == 1 ? 32 : 16); ++q) {
        const int wide = mode == 1 ? etc1_expand5(q) : etc1_expand4(q);
        const int off = std::abs(std::clamp(wide + add, 0, 255) - value);
        if (off < best) {
          best = off;
          best_base = q;
        }
      }
      const auto at = static_cast<std::size_t>(value);
      base[mode][modifier][at] = static_cast<std::uint8_t>(best_base);
      miss[mode][modifier][at] = static_cast<std::uint8_t>(best);
    }
  }
};

const SolidTable& solid_table() {
  static const SolidTable table;
  return table;
}

/// All pixels of one code in the low word.
constexpr std::uint64_t codes_of(std::size_t code) {
  return (code >= 2 ? std::uint64_t{0xffff0000} : 0) | (code % 2 == 1 ? 0xffff : 0);
}

}  // namespace

std::uint64_t encode_solid_etc1(std::uint32_t rgb, bool perceptual) {
  const SolidTable& table = solid_table();
  const std::size_t value[3] = {rgb & 255, rgb >> 8 & 255, rgb >> 16 & 255};
  const std::uint32_t weight[3] = {perceptual ? 3U : 1U, perceptual ? 6U : 1U, 1U};
  std::uint32_t best = ~0U;
  std::size_t best_mode = 0;
  std::size_t best_modifier = 0;
  for (std::size_t mode = 0; mode < 2; ++mode) {
    for (std::size_t modifier = 0; modifier < kModifiers; ++modifier) {
      std::uint32_t error = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint32_t miss = table.miss[mode][modifier][value[c]];
        error += weight[c] * miss * miss;
      }
      if (error >= best) continue;
      best = error;
      best_mode = mode;
      best_modifier = modifier;
    }
  }
  std::uint64_t high = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::uint64_t base = table.base[best_mode][best_modifier][value[c]];
    high = high << 8 | (best_mode == 1 ? base << 3 : base << 4 | base);
  }
  const std::uint64_t tables = best_modifier / 4 * 9;  // the same table in both halves
  high = high << 8 | tables << 2 | best_mode << 1;
  return high << 32 | codes_of(best_modifier % 4);
}

}  // namespace modar
