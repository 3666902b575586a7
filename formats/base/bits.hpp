// Bit counts: libc++ of Android's NDKs up to r25 has none of std::bit_width, std::has_single_bit.
#pragma once

#include <cstdint>

namespace modar {

/// Bits that `value` takes; 0 for 0.
constexpr int bit_width(std::uint64_t value) {
  return value == 0 ? 0 : 64 - __builtin_clzll(value);
}

constexpr bool is_power_of_two(std::uint64_t value) {
  return value != 0 && (value & (value - 1)) == 0;
}

}  // namespace modar
