// Decimal numbers out of padded text: the shortest exact path, fast_float for the rest.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace modar {

// Classes of characters of OBJ text, whatever the locale.

/// What separates the words of a statement. A NUL counts too: damaged files hold them.
constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\0';
}
constexpr bool is_line_end(char c) {
  return c == '\n' || c == '\r';
}
constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Text passed to these functions must end in a byte that is not part of a number, followed by at
/// least this many readable bytes.
inline constexpr std::size_t kTextPadding = 128;

/// The text where a number was expected.
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
inline const char* parse_digits(const char* p, std::uint64_t& value, unsigned& count) {
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

/// The slow path, for whatever parse_real() does not handle itself. `p` is the start of the token.
const char* parse_real_slow(const char* p, const char* end, double& value, NumberKind& kind);

/// Applies a sign without a branch, which random signs would mispredict.
inline double with_sign(double magnitude, bool negative) {
  const std::uint64_t sign = std::uint64_t{negative} << 63;
  return __builtin_bit_cast(double, __builtin_bit_cast(std::uint64_t, magnitude) | sign);
}

#ifdef __SSE2__
/// "-12.345678" at p: a minus or none, digits, a point, digits, 1 to 8 of each, 16 bytes with what
/// ends it. One look at the bytes finds both ends, so parsing the next number need not wait for the
/// digits of this one. Returns the first byte after it; nullptr for anything else.
inline const char* parse_short_real(const char* p, double& value) {
  const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
  // As signed bytes, '0' to '9' are the ten greatest once '9' is moved up to 127.
  const __m128i moved = _mm_add_epi8(bytes, _mm_set1_epi8(127 - '9'));
  const __m128i digit = _mm_cmpgt_epi8(moved, _mm_set1_epi8(127 - 10));
  unsigned other = ~static_cast<unsigned>(_mm_movemask_epi8(digit)) & 0xFFFEu;
  const auto point = static_cast<unsigned>(std::countr_zero(other | 0x10000u));
  other &= other - 1;
  const auto end = static_cast<unsigned>(std::countr_zero(other | 0x10000u));
  const bool negative = *p == '-';
  const unsigned before = point - static_cast<unsigned>(negative);
  const unsigned after = end - point - 1;
  const bool starts = negative || static_cast<unsigned char>(*p - '0') < 10;
  if (end > 15 || p[point] != '.' || !starts || before - 1 > 7 || after - 1 > 7 || p[end] >= 'E') {
    return nullptr;
  }
  std::uint64_t whole = 0;
  std::uint64_t fraction = 0;
  std::memcpy(&whole, p + static_cast<unsigned>(negative), sizeof whole);
  std::memcpy(&fraction, p + point + 1, sizeof fraction);
  const std::uint64_t mantissa =
      digits_value(whole, before) * kPowersOfTen[after] + digits_value(fraction, after);
  if (mantissa > (1ull << 53)) return nullptr;
  value = with_sign(static_cast<double>(mantissa) / kExactPowersOfTen[after], negative);
  return p + end;
}
#endif

}  // namespace detail

/// The number at p if it is as plain as nearly all are: sign, digits, point, digits, at most 19 of
/// them, no exponent. Returns the first byte after it; nullptr for anything else.
inline const char* parse_plain_real(const char* p, double& value) {
#ifdef __SSE2__
  if (const char* const end = detail::parse_short_real(p, value)) return end;
#endif
  const bool negative = *p == '-';
  p += static_cast<int>(negative || *p == '+');
  std::uint64_t mantissa = 0;
  unsigned digits = 0;
  p = detail::parse_digits(p, mantissa, digits);
  unsigned fraction = 0;
  // A comma between digits is the point of programs that follow a locale: no list has commas.
  if (*p == '.' || (*p == ',' && digits != 0 && is_digit(p[1]))) {
    const unsigned before = digits;
    p = detail::parse_digits(p + 1, mantissa, digits);
    fraction = digits - before;
  }
  // Both operands are exact, so the single rounding is correct (Clinger, "How to read floating
  // point numbers accurately", 1990). Letters from 'E' on may continue the number.
  if (digits - 1u > 18u || mantissa > (1ull << 53) || *p >= 'E') return nullptr;
  value = detail::with_sign(static_cast<double>(mantissa) / detail::kExactPowersOfTen[fraction],
                            negative);
  return p;
}

/// Reads a decimal number at p, correctly rounded in any locale. Accepts a leading '+', ".5", "2.",
/// exponents, "nan" and "inf" in any case. Returns the first byte after it (p if none). end: end of
/// the text, padding excluded.
inline const char* parse_real(const char* p, const char* end, double& value, NumberKind& kind) {
  const char* const plain = parse_plain_real(p, value);
  if (plain == nullptr) return detail::parse_real_slow(p, end, value, kind);
  kind = NumberKind::kFinite;
  return plain;
}

}  // namespace modar
