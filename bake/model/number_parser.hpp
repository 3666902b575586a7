// Decimal numbers out of padded text: the shortest exact path, fast_float for the rest.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace modar {

/// Text handed to these functions must be followed by at least this many readable bytes, the first
/// of which is neither a digit nor part of a number.
inline constexpr std::size_t kTextPadding = 16;

/// What stood where a number was expected.
enum class NumberKind : std::uint8_t { kFinite, kNotFinite, kNone };

namespace detail {

inline constexpr std::array<std::uint64_t, 9> kPowersOfTen = {
    1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000};

/// Doubles hold powers of ten up to 22 exactly.
inline constexpr std::array<double, 23> kExactPowersOfTen = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/// Digits at the front of eight bytes: how many (0 to 8).
inline unsigned count_digits(std::uint64_t bytes) {
  const std::uint64_t low = bytes ^ 0x3030303030303030u;
  const std::uint64_t other = ((low + 0x7676767676767676u) | low) & 0x8080808080808080u;
  return other == 0 ? 8u : static_cast<unsigned>(std::countr_zero(other)) / 8u;
}

/// Value of the first `count` (1 to 8) of eight bytes, which are digits: pairs, then fours, then
/// eight digits at a time in one register (Lemire, "Number parsing at a gigabyte per second",
/// 2021).
inline std::uint64_t digits_value(std::uint64_t bytes, unsigned count) {
  std::uint64_t v = (bytes ^ 0x3030303030303030u) << (64u - 8u * count);
  v = v * 10 + (v >> 8);
  constexpr std::uint64_t kMask = 0x000000FF000000FFu;
  constexpr std::uint64_t kMul1 = 0x000F424000000064u;
  constexpr std::uint64_t kMul2 = 0x0000271000000001u;
  return (((v & kMask) * kMul1) + (((v >> 16) & kMask) * kMul2)) >> 32;
}

/// Appends the digits at p to `value` and their number to `count`; returns the first byte after
/// them. Wraps beyond 19 digits: the caller looks at `count`.
inline const char* take_digits(const char* p, std::uint64_t& value, unsigned& count) {
  static_assert(std::endian::native == std::endian::little);
  while (true) {
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, p, sizeof bytes);
    const unsigned n = count_digits(bytes);
    if (n == 0) return p;
    value = value * kPowersOfTen[n] + digits_value(bytes, n);
    count += n;
    p += n;
    if (n < 8) return p;
  }
}

/// The careful way, for whatever take_real() does not answer at once. `p` is the start of the
/// token.
const char* take_real_slow(const char* p, const char* end, double& value, NumberKind& kind);

}  // namespace detail

/// Reads a decimal number at p, correctly rounded whatever the locale. Knows a leading '+', ".5",
/// "2.", exponents, "nan" and "inf" in any case. Returns the first byte after it (p where there is
/// none). end: end of the text, padding excluded.
inline const char* take_real(const char* p, const char* end, double& value, NumberKind& kind) {
  const char* const start = p;
  const bool negative = *p == '-';
  p += static_cast<int>(negative || *p == '+');
  std::uint64_t mantissa = 0;
  unsigned digits = 0;
  p = detail::take_digits(p, mantissa, digits);
  unsigned fraction = 0;
  if (*p == '.') {
    const unsigned before = digits;
    p = detail::take_digits(p + 1, mantissa, digits);
    fraction = digits - before;
  }
  // Both factors exact: one rounding, hence the right one (Clinger, 1990).
  const bool exact = digits != 0 && digits <= 19 && mantissa <= (1ull << 53) && fraction <= 22;
  if (!exact || (*p | 0x20) == 'e') return detail::take_real_slow(start, end, value, kind);
  const double magnitude = static_cast<double>(mantissa) / detail::kExactPowersOfTen[fraction];
  value = negative ? -magnitude : magnitude;
  kind = NumberKind::kFinite;
  return p;
}

}  // namespace modar
