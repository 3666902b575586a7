// The numbers of a plain OBJ line out of one look at the 64 bytes behind its keyword: all their
// ends are known at once, and two numbers are computed in one register. Internal to the OBJ reader.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "bake/import/obj/number_parser.hpp"
#include "bake/import/obj/obj_block.hpp"

#ifdef __SSE2__
namespace modar::detail {

/// Bytes that a window looks at.
inline constexpr std::size_t kWindow = 64;
static_assert(2 * kWindow <= kTextPadding);  // see index_ends()

/// Digits of a number at most: what a lane of eight bytes holds.
inline constexpr unsigned kMostDigits = 8;

/// A bit for each of the bytes at p from `kFrom` to `kTo`, multiples of 16. test: sets the highest
/// bit of some of 16 bytes.
template <unsigned kFrom, unsigned kTo, class Test>
std::uint64_t window_bits(const char* p, const Test& test) {
  static_assert(kTo <= kWindow);
  std::uint64_t bits = 0;
  for (unsigned i = kFrom; i < kTo; i += 16) {
    const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p + i));
    const auto mask = static_cast<std::uint32_t>(_mm_movemask_epi8(test(bytes)));
    bits |= std::uint64_t{mask} << i;
  }
  return bits;
}

/// The bytes that are not in [kLow, '9'].
template <char kLow, unsigned kFrom, unsigned kTo>
std::uint64_t bytes_outside(const char* p) {
  const __m128i low = _mm_set1_epi8(kLow);
  const __m128i rest = _mm_set1_epi8(127 - ('9' - kLow));
  return window_bits<kFrom, kTo>(
      p, [&](__m128i bytes) { return _mm_adds_epu8(_mm_sub_epi8(bytes, low), rest); });
}

template <unsigned kFrom, unsigned kTo>
std::uint64_t points_in(const char* p) {
  const __m128i point = _mm_set1_epi8('.');
  return window_bits<kFrom, kTo>(p, [&](__m128i bytes) { return _mm_cmpeq_epi8(bytes, point); });
}

/// The places of the lowest kCount bits, which are taken; false where there are fewer.
template <std::size_t kCount>
[[gnu::always_inline]] inline bool parse_bits(std::uint64_t& bits,
                                              std::array<unsigned, kCount>& places) {
  std::array<std::uint64_t, kCount> left;
  for (std::uint64_t& each : left) {
    each = bits;
    bits &= bits - 1;
  }
  if (left[kCount - 1] == 0) return false;
  for (std::size_t i = 0; i < kCount; ++i) {
    places[i] = static_cast<unsigned>(__builtin_ctzll(left[i]));
  }
  return true;
}

/// The last n of the eight bytes of a lane, for n from 0 to 8.
inline constexpr std::array<std::uint64_t, kMostDigits + 1> kLastBytes = {0,
                                                                          0xFF00000000000000u,
                                                                          0xFFFF000000000000u,
                                                                          0xFFFFFF0000000000u,
                                                                          0xFFFFFFFF00000000u,
                                                                          0xFFFFFFFFFF000000u,
                                                                          0xFFFFFFFFFFFF0000u,
                                                                          0xFFFFFFFFFFFFFF00u,
                                                                          0xFFFFFFFFFFFFFFFFu};

/// Two times eight bytes at any places.
inline __m128i load_lanes(const void* low, const void* high) {
  double first = 0;
  double second = 0;
  std::memcpy(&first, low, sizeof first);
  std::memcpy(&second, high, sizeof second);
  return _mm_castpd_si128(_mm_set_pd(second, first));
}

/// A number of a line: where it ends, and its digits, up to 8.
struct Digits {
  const char* end;
  unsigned count;
};

/// Two times eight digits, 0 to 9 a byte, to two times two numbers of four digits.
inline __m128i join_fours(__m128i digits) {
  const __m128i tens =
      _mm_mullo_epi16(_mm_and_si128(digits, _mm_set1_epi16(0xFF)), _mm_set1_epi16(10));
  const __m128i pairs = _mm_add_epi16(tens, _mm_srli_epi16(digits, 8));
  return _mm_madd_epi16(pairs, _mm_set1_epi32(0x00010064));  // 100 times the first, and the second
}

/// What join_fours() made of four numbers, to those numbers.
inline __m128i join_eights(__m128i first, __m128i second) {
  const __m128i fours = _mm_packs_epi32(first, second);
  return _mm_madd_epi16(fours, _mm_set1_epi32(0x00012710));  // 10,000 times the first
}

inline __m128i digit_lanes(const Digits& low, const Digits& high) {
  const __m128i bytes = load_lanes(low.end - kMostDigits, high.end - kMostDigits);
  const __m128i mask = load_lanes(&kLastBytes[low.count], &kLastBytes[high.count]);
  return _mm_and_si128(_mm_sub_epi8(bytes, _mm_set1_epi8('0')), mask);
}

/// The values of four numbers, which consist of digits.
inline __m128i four_values(const Digits& a, const Digits& b, const Digits& c, const Digits& d) {
  return join_eights(join_fours(digit_lanes(a, b)), join_fours(digit_lanes(c, d)));
}

/// A decimal of a line: "-123.456789", with 1 to 8 digits on either side of the point, 9 in all.
struct Decimal {
  const char* end;
  unsigned digits;   ///< in all, 8 at most
  unsigned after;    ///< behind the point
  unsigned divisor;  ///< of kDivisors
  unsigned lead;     ///< of kLeads
};

/// The value of a digit before eight others.
inline constexpr std::array<double, 10> kLeads = {0e8, 1e8, 2e8, 3e8, 4e8, 5e8, 6e8, 7e8, 8e8, 9e8};

/// Powers of ten, positive and negative: dividing gives the sign, also of 0.
inline constexpr std::array<double, 18> kDivisors = {1e0, -1e0, 1e1, -1e1, 1e2, -1e2,
                                                     1e3, -1e3, 1e4, -1e4, 1e5, -1e5,
                                                     1e6, -1e6, 1e7, -1e7, 1e8, -1e8};

/// The digits of two decimals without the points; sets bytes of `bad` where they are not.
inline __m128i decimal_lanes(const Decimal& low, const Decimal& high, __m128i& bad) {
  // Those before the point are one byte farther from the end.
  const __m128i behind = load_lanes(low.end - kMostDigits, high.end - kMostDigits);
  const __m128i before = load_lanes(low.end - kMostDigits - 1, high.end - kMostDigits - 1);
  const __m128i split = load_lanes(&kLastBytes[low.after], &kLastBytes[high.after]);
  const __m128i mask = load_lanes(&kLastBytes[low.digits], &kLastBytes[high.digits]);
  const __m128i bytes = _mm_or_si128(_mm_and_si128(behind, split), _mm_andnot_si128(split, before));
  const __m128i digits = _mm_and_si128(_mm_sub_epi8(bytes, _mm_set1_epi8('0')), mask);
  bad = _mm_or_si128(bad, _mm_subs_epu8(digits, _mm_set1_epi8(9)));
  return digits;
}

/// The values of two decimals, whose digits the low half of `numbers` has. Both operands of the
/// division are exact, so the single rounding is correct (see parse_plain_real()).
inline __m128d decimal_pair(__m128i numbers, const Decimal& low, const Decimal& high) {
  const __m128i divisors = load_lanes(&kDivisors[low.divisor], &kDivisors[high.divisor]);
  const __m128i leads = load_lanes(&kLeads[low.lead], &kLeads[high.lead]);
  const __m128d values = _mm_add_pd(_mm_cvtepi32_pd(numbers), _mm_castsi128_pd(leads));
  return _mm_div_pd(values, _mm_castsi128_pd(divisors));
}

/// Computes two, three or six decimals, two in a register; false where one of them is no number.
template <std::size_t kCount>
[[gnu::always_inline]] inline bool decimal_values(const std::array<Decimal, kCount>& decimals,
                                                  double* values) {
  constexpr std::size_t kPairs = (kCount + 1) / 2;
  const auto second_of = [&](std::size_t pair) -> const Decimal& {
    return decimals[std::min(2 * pair + 1, kCount - 1)];
  };
  __m128i bad = _mm_setzero_si128();
  __m128i fours[kPairs];
  for (std::size_t i = 0; i < kPairs; ++i) {
    fours[i] = join_fours(decimal_lanes(decimals[2 * i], second_of(i), bad));
  }
  for (std::size_t i = 0; i < kPairs; ++i) {
    __m128i numbers = join_eights(fours[i - i % 2], fours[std::min(i - i % 2 + 1, kPairs - 1)]);
    if (i % 2 != 0) numbers = _mm_unpackhi_epi64(numbers, numbers);
    const __m128d pair = decimal_pair(numbers, decimals[2 * i], second_of(i));
    if (2 * i + 1 < kCount) {
      _mm_storeu_pd(values + 2 * i, pair);
    } else {
      _mm_store_sd(values + 2 * i, pair);
    }
  }
  return _mm_movemask_epi8(_mm_cmpeq_epi8(bad, _mm_setzero_si128())) == 0xFFFF;
}

/// Which bytes of a line end numbers, and which are points.
struct DecimalMarks {
  std::uint64_t ends;
  std::uint64_t points;
};

/// kCount decimals at p, each after one blank but the first. Returns the place of the first
/// byte after them, 0 for anything else. Reads from kTextPadding bytes ahead of p.
template <std::size_t kCount>
[[gnu::always_inline]] inline unsigned parse_decimals(const char* p, DecimalMarks& marks,
                                                      double* values) {
  std::array<unsigned, kCount> ends;
  std::array<unsigned, kCount> points;
  if (!parse_bits(marks.ends, ends) || !parse_bits(marks.points, points)) return 0;
  std::array<Decimal, kCount> decimals;
  unsigned excess = 0;
  unsigned begin = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (i > 0 && p[ends[i - 1]] != ' ') return 0;
    const unsigned negative = p[begin] == '-' ? 1 : 0;
    const unsigned before = points[i] - begin - negative;
    const unsigned after = ends[i] - points[i] - 1;
    const unsigned digits = before + after;
    // Of more digits than a lane holds, the first one.
    const unsigned lead =
        digits > kMostDigits ? static_cast<unsigned>(p[begin + negative] - '0') : 0;
    excess |= (before - 1) | (after - 1) | (kMostDigits + 1 - digits) | (lead > 9 ? 8 : 0);
    decimals[i] = {p + ends[i], std::min(digits, kMostDigits), after, 2 * after + negative, lead};
    begin = ends[i] + 1;
  }
  if (excess >= kMostDigits || !decimal_values(decimals, values)) return 0;
  return ends[kCount - 1];
}

/// Three or six decimals at p, each after one blank but the first. Returns the first byte after
/// them and their count; nullptr for anything else.
inline const char* parse_three_or_six(const char* p, double* values, unsigned& count) {
  // Three end within 48 bytes.
  DecimalMarks marks = {bytes_outside<'-', 0, 48>(p), points_in<0, 48>(p)};
  const std::uint64_t from_second = marks.ends & (marks.ends - 1);
  const std::uint64_t from_third = from_second & (from_second - 1);
  if (from_third == 0) return nullptr;
  unsigned end = 0;
  count = 3;
  if (p[__builtin_ctzll(from_third)] != ' ') {
    end = parse_decimals<3>(p, marks, values);
  } else {
    count = 6;
    marks.ends |= bytes_outside<'-', 48, 64>(p);
    marks.points |= points_in<48, 64>(p);
    end = parse_decimals<6>(p, marks, values);
  }
  return end == 0 ? nullptr : p + end;
}

/// Two decimals at p, with one blank between them.
inline const char* parse_two(const char* p, double* values) {
  DecimalMarks marks = {bytes_outside<'-', 0, 32>(p), points_in<0, 32>(p)};
  const unsigned end = parse_decimals<2>(p, marks, values);
  return end == 0 ? nullptr : p + end;
}

/// How many indices a corner has, and how many bytes end one.
constexpr std::size_t indices_of(CornerKind kind) {
  return kind == CornerKind::kPosition ? 1 : kind == CornerKind::kUvNormal ? 3 : 2;
}
constexpr std::size_t ends_of(CornerKind kind) {
  return kind == CornerKind::kNormal ? 3 : indices_of(kind);
}

/// Indices of three or four corners, 32 bits each: values as the file has them, none of them 0; of
/// three, the fourth repeats the third.
struct CornerIndices {
  __m128i four;
};

/// The greater ones of two times four numbers below 2^31.
inline __m128i greater(__m128i a, __m128i b) {
  const __m128i first = _mm_cmpgt_epi32(a, b);
  return _mm_or_si128(_mm_and_si128(first, a), _mm_andnot_si128(first, b));
}

/// The places of kCount bytes that are no digits, kEach a corner. Three a corner may take more
/// bytes than a window has: then the corners from the third on get one of their own.
template <std::size_t kEach, std::size_t kCount>
[[gnu::always_inline]] inline bool index_ends(const char* p, std::array<unsigned, kCount>& ends) {
  constexpr unsigned kBytes = kCount == 3 ? 32 : kCount == 4 ? 48 : kWindow;
  std::uint64_t others = bytes_outside<'0', 0, kBytes>(p);
  if constexpr (kEach < 3) {
    return parse_bits(others, ends);
  } else {
    std::array<unsigned, 6> two_corners;
    std::array<unsigned, kCount - 6> rest;
    if (!parse_bits(others, two_corners)) return false;
    const unsigned begin = two_corners[5] + 1;
    others = bytes_outside < '0', 0, kCount == 9 ? 32 : kWindow > (p + begin);
    if (!parse_bits(others, rest)) return false;
    std::copy(two_corners.begin(), two_corners.end(), ends.begin());
    for (std::size_t i = 0; i < rest.size(); ++i) ends[6 + i] = begin + rest[i];
    return true;
  }
}

/// Three or four corners of a kind at p, each after one blank but the first. Returns the first byte
/// after them; nullptr for anything else. Reads from kTextPadding bytes ahead of p.
template <std::size_t kCorners, CornerKind kKind>
[[gnu::always_inline]] inline const char* take_corners(
    const char* p, std::array<CornerIndices, indices_of(kKind)>& indices) {
  static_assert(kCorners == 3 || kCorners == 4);
  constexpr std::size_t kEach = ends_of(kKind);
  constexpr std::size_t kCount = kCorners * kEach;
  std::array<unsigned, kCount> ends;
  if (!index_ends<kEach>(p, ends)) return nullptr;
  unsigned excess = 0;
  std::array<Digits, kCount> digits;
  for (std::size_t i = 0; i < kCount; ++i) {
    const char between = i % kEach == 0 ? ' ' : '/';
    if (i > 0 && p[ends[i - 1]] != between) return nullptr;
    digits[i] = {p + ends[i], i > 0 ? ends[i] - ends[i - 1] - 1 : ends[i]};
    const bool empty = kKind == CornerKind::kNormal && i % kEach == 1;  // between two slashes
    excess |= empty ? kMostDigits * digits[i].count : digits[i].count - 1;
  }
  if (excess >= kMostDigits) return nullptr;
  __m128i zeros = _mm_setzero_si128();
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const std::size_t at = kKind == CornerKind::kNormal ? 2 * i : i;
    const Digits& third = digits[2 * kEach + at];
    const Digits& fourth = kCorners == 4 ? digits[kCount - kEach + at] : third;
    const __m128i four = four_values(digits[at], digits[kEach + at], third, fourth);
    indices[i].four = four;
    zeros = _mm_or_si128(zeros, _mm_cmpeq_epi32(four, _mm_setzero_si128()));
  }
  return _mm_movemask_epi8(zeros) == 0 ? p + ends[kCount - 1] : nullptr;
}

}  // namespace modar::detail
#endif
