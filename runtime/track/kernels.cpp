// The kernels, compiled once a SIMD level from this one source (Highway).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/track/kernels.cpp"
// Targets that gain little here and cost code: SSSE3 and AVX-512 on x86, SVE on ARM.
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_AVX3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
// Highway includes this file once per target, so the order of these two is fixed.
#include "kernels.hpp"

#include <algorithm>
#include <cstring>

#include "formats/base/simd_level.hpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace modar::tracker::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D8 = hn::ScalableTag<std::uint8_t>;
using D16 = hn::ScalableTag<std::uint16_t>;
using Half8 = hn::Rebind<std::uint8_t, D16>;
using V8 = hn::Vec<D8>;

inline int lanes8() {
  return static_cast<int>(hn::Lanes(D8()));
}
inline int lanes16() {
  return static_cast<int>(hn::Lanes(D16()));
}

void halve_row(const std::uint8_t* top, const std::uint8_t* bottom, std::uint8_t* out, int count) {
  int i = 0;
#if HWY_TARGET != HWY_SCALAR
  const D16 wide;
  const Half8 narrow;
  const int step = lanes16();
  // A 16-bit lane holds two neighbouring pixels, in any byte order.
  for (; i + step <= count; i += step) {
    const auto low = hn::Set(wide, 0x00FF);
    const auto a = hn::BitCast(wide, hn::LoadU(hn::Repartition<std::uint8_t, D16>(), top + 2 * i));
    const auto b =
        hn::BitCast(wide, hn::LoadU(hn::Repartition<std::uint8_t, D16>(), bottom + 2 * i));
    const auto sum_a = hn::Add(hn::And(a, low), hn::ShiftRight<8>(a));
    const auto sum_b = hn::Add(hn::And(b, low), hn::ShiftRight<8>(b));
    const auto sum = hn::Add(hn::Add(sum_a, sum_b), hn::Set(wide, 2));
    hn::StoreU(hn::DemoteTo(narrow, hn::BitCast(hn::RebindToSigned<D16>(), hn::ShiftRight<2>(sum))),
               narrow, out + i);
  }
#endif
  for (; i < count; ++i) {
    const int sum = top[2 * i] + top[2 * i + 1] + bottom[2 * i] + bottom[2 * i + 1];
    out[i] = static_cast<std::uint8_t>((sum + 2) >> 2);
  }
}

void blur_columns(const std::uint8_t* const* rows, std::uint16_t* out, int count) {
  const D16 wide;
  const Half8 narrow;
  const int step = lanes16();
  int i = 0;
  for (; i + step <= count; i += step) {
    const auto at = [&](int row) { return hn::PromoteTo(wide, hn::LoadU(narrow, rows[row] + i)); };
    const auto centre = at(2);
    const auto inner = hn::ShiftLeft<2>(hn::Add(hn::Add(at(1), at(3)), centre));
    hn::StoreU(hn::Add(hn::Add(inner, hn::Add(centre, centre)), hn::Add(at(0), at(4))), wide,
               out + i);
  }
  for (; i < count; ++i) {
    out[i] = static_cast<std::uint16_t>(rows[0][i] + rows[4][i] + 4 * (rows[1][i] + rows[3][i]) +
                                        6 * rows[2][i]);
  }
}

void blur_row(const std::uint16_t* in, std::uint8_t* out, int count) {
  const D16 wide;
  const Half8 narrow;
  const int step = lanes16();
  for (int i = 0; i < count; i += step) {
    const auto centre = hn::LoadU(wide, in + i);
    const auto inner = hn::ShiftLeft<2>(
        hn::Add(hn::Add(hn::LoadU(wide, in + i - 1), hn::LoadU(wide, in + i + 1)), centre));
    const auto outer = hn::Add(hn::LoadU(wide, in + i - 2), hn::LoadU(wide, in + i + 2));
    // At most 16 * 16 * 255 + 128 = 65,408.
    const auto sum =
        hn::Add(hn::Add(inner, hn::Add(centre, centre)), hn::Add(outer, hn::Set(wide, 128)));
    hn::StoreU(hn::DemoteTo(narrow, hn::BitCast(hn::RebindToSigned<D16>(), hn::ShiftRight<8>(sum))),
               narrow, out + i);
  }
}

/// The greatest of the least values of all 16 arcs of nine neighbours, or if not `kBrighter`, the
/// least of their greatest: an arc and the next share eight of them.
template <bool kBrighter>
inline V8 best_arc(const V8* ring) {
  const auto worst = [](V8 a, V8 b) { return kBrighter ? hn::Min(a, b) : hn::Max(a, b); };
  const auto best_of = [](V8 a, V8 b) { return kBrighter ? hn::Max(a, b) : hn::Min(a, b); };
  V8 four[8];
  for (int k = 0; k < 8; ++k) four[k] = worst(ring[2 * k], ring[2 * k + 1]);
  const V8 first = four[0];
  for (int k = 0; k < 7; ++k) four[k] = worst(four[k], four[k + 1]);
  four[7] = worst(four[7], first);
  V8 best = hn::Set(D8(), kBrighter ? 0 : 255);
  for (int k = 0; k < 8; ++k) {
    const V8 eight = worst(four[k], four[(k + 2) & 7]);
    const V8 ends = best_of(ring[(2 * k + 15) & 15], ring[(2 * k + 8) & 15]);
    best = best_of(best, worst(eight, ends));
  }
  return best;
}

/// Bresenham circle of radius 3, clockwise from above.
struct Ring {
  std::ptrdiff_t at[16];
  explicit Ring(std::ptrdiff_t stride)
      : at{-3 * stride, -3 * stride + 1, -2 * stride + 2, -stride + 3,
           3,           stride + 3,      2 * stride + 2,  3 * stride + 1,
           3 * stride,  3 * stride - 1,  2 * stride - 2,  stride - 3,
           -3,          -stride - 3,     -2 * stride - 2, -3 * stride - 1} {}
};

void corner_scores(const std::uint8_t* pixels, std::ptrdiff_t stride, int threshold, int count,
                   std::uint8_t* bright, std::uint8_t* score) {
  const D8 d;
  const Ring ring(stride);
  const V8 zero = hn::Zero(d);
  const V8 least = hn::Set(d, static_cast<std::uint8_t>(threshold - 1));
  for (int i = 0; i < count; i += lanes8()) {
    const std::uint8_t* at = pixels + i;
    const V8 centre = hn::LoadU(d, at);
    // Nine in sequence contain one of each pair of opposite points: `up` and `down` bound what
    // their arcs can reach.
    V8 up = hn::Set(d, 255);
    V8 down = zero;
    const auto bound_by = [&](int k) {
      const V8 p = hn::LoadU(d, at + ring.at[k]);
      const V8 q = hn::LoadU(d, at + ring.at[k + 8]);
      up = hn::Min(up, hn::Max(p, q));
      down = hn::Max(down, hn::Min(p, q));
    };
    const auto any = [&](V8 difference) { return !hn::AllFalse(d, hn::Gt(difference, least)); };
    V8 best_up = zero;
    V8 best_down = zero;
    bound_by(0);
    bound_by(4);
    if (any(hn::Max(hn::SaturatedSub(up, centre), hn::SaturatedSub(centre, down)))) {
      for (int k = 2; k < 8; k += 4) bound_by(k);
      for (int k = 1; k < 8; k += 2) bound_by(k);
      const bool any_up = any(hn::SaturatedSub(up, centre));
      const bool any_down = any(hn::SaturatedSub(centre, down));
      if (any_up || any_down) {
        V8 points[16];
        for (int k = 0; k < 16; ++k) points[k] = hn::LoadU(d, at + ring.at[k]);
        if (any_up) best_up = hn::SaturatedSub(best_arc<true>(points), centre);
        if (any_down) best_down = hn::SaturatedSub(centre, best_arc<false>(points));
      }
    }
    const auto over = [&](V8 best) { return hn::IfThenElseZero(hn::Gt(best, least), best); };
    hn::StoreU(over(best_up), d, bright + i);
    hn::StoreU(over(hn::Max(best_up, best_down)), d, score + i);
  }
}

void peaks(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below, int count,
           std::uint8_t* peak) {
  const D8 d;
  for (int i = 0; i < count; i += lanes8()) {
    const V8 centre = hn::LoadU(d, row + i);
    const V8 before = hn::Max(hn::Max(hn::LoadU(d, above + i - 1), hn::LoadU(d, above + i)),
                              hn::Max(hn::LoadU(d, above + i + 1), hn::LoadU(d, row + i - 1)));
    const V8 after = hn::Max(hn::Max(hn::LoadU(d, below + i - 1), hn::LoadU(d, below + i)),
                             hn::Max(hn::LoadU(d, below + i + 1), hn::LoadU(d, row + i + 1)));
    const auto keep = hn::And(hn::Gt(centre, before), hn::Eq(hn::Max(centre, after), centre));
    hn::StoreU(hn::IfThenElseZero(keep, centre), d, peak + i);
  }
}

/// Vectors that a block's byte k of all codes fills.
constexpr int kBlockVectors = static_cast<int>(hn::MaxLanes(D8())) < kBlockCodes
                                  ? kBlockCodes / static_cast<int>(hn::MaxLanes(D8()))
                                  : 1;

/// Byte k of a block's codes. On ARM one load takes even and odd codes apart; store_codes() puts
/// them together again.
inline void load_codes(const std::uint8_t* bytes, V8* vectors) {
#if HWY_TARGET == HWY_NEON
  hn::LoadInterleaved2(D8(), bytes, vectors[0], vectors[1]);
#else
#pragma GCC unroll 2
  for (int v = 0; v < kBlockVectors; ++v) vectors[v] = hn::LoadU(D8(), bytes + v * lanes8());
#endif
}

inline void store_codes(const V8* vectors, std::uint8_t* bytes) {
#if HWY_TARGET == HWY_NEON
  hn::StoreInterleaved2(vectors[0], vectors[1], D8(), bytes);
#else
#pragma GCC unroll 2
  for (int v = 0; v < kBlockVectors; ++v) hn::StoreU(vectors[v], D8(), bytes + v * lanes8());
#endif
}

/// Bits that are set in each byte.
inline V8 count_ones(V8 bytes) {
#if HWY_TARGET == HWY_WASM
  // Highway 1.0 emulates it by tables: a frame that searches took 105 CPU-ms in V8, and takes 16.
  return V8{wasm_i8x16_popcnt(bytes.raw)};
#else
  return hn::PopulationCount(bytes);
#endif
}

/// Adds the differing bits of 16 bytes of the codes of `kBlocks` blocks. No sum exceeds a lane: 256
/// differing bits count as 255.
template <bool kSecond, std::size_t kBlocks>
inline void count_bits(const std::uint8_t* code, const std::uint8_t* blocks,
                       V8 (*sums)[kBlockVectors]) {
#pragma GCC unroll 2
  for (std::size_t k = 0; k < kCodeBytes / 2; ++k) {
    const V8 byte = hn::Set(D8(), code[k]);
#pragma GCC unroll 2
    for (std::size_t b = 0; b < kBlocks; ++b) {
      V8 others[kBlockVectors];
      load_codes(blocks + (b * kCodeBytes + k) * kBlockCodes, others);
#pragma GCC unroll 2
      for (int v = 0; v < kBlockVectors; ++v) {
        V8& sum = sums[b][v];
        const V8 bits = count_ones(hn::Xor(byte, others[v]));
        sum = kSecond ? hn::SaturatedAdd(sum, bits) : hn::Add(sum, bits);
      }
    }
  }
}

/// The distances of a code to those of `kBlocks` blocks; lowers `least` to the smallest. Two blocks
/// at once share the code's bytes.
template <std::size_t kBlocks>
inline void compare_blocks(const std::uint8_t* code, const std::uint8_t* blocks, V8 most,
                           std::uint8_t* out, V8& least) {
  const D8 d;
  V8 sums[kBlocks][kBlockVectors];
#pragma GCC unroll 2
  for (std::size_t b = 0; b < kBlocks; ++b) {
#pragma GCC unroll 2
    for (int v = 0; v < kBlockVectors; ++v) sums[b][v] = hn::Zero(d);
  }
  count_bits<false, kBlocks>(code, blocks, sums);
#pragma GCC unroll 2
  for (std::size_t b = 0; b < kBlocks; ++b) {
    V8* mine = sums[b];
    V8 nearest = mine[0];
#pragma GCC unroll 2
    for (int v = 1; v < kBlockVectors; ++v) nearest = hn::Min(nearest, mine[v]);
    if (hn::AllFalse(d, hn::Eq(hn::Min(nearest, most), nearest))) {
#pragma GCC unroll 2
      for (int v = 0; v < kBlockVectors; ++v) mine[v] = hn::Set(d, 255);
    } else {
      const std::uint8_t* rest = blocks + (b * kCodeBytes + kCodeBytes / 2) * kBlockCodes;
      count_bits<true, 1>(code + kCodeBytes / 2, rest, sums + b);
#pragma GCC unroll 2
      for (int v = 0; v < kBlockVectors; ++v) least = hn::Min(least, mine[v]);
    }
    store_codes(mine, out + b * kBlockCodes);
  }
}

int distances(const std::uint8_t* code, const std::uint8_t* blocks, std::size_t block_count,
              int limit, std::uint8_t* out) {
  const D8 d;
  constexpr std::size_t kBytes = std::size_t{kBlockCodes} * kCodeBytes;
  const V8 most = hn::Set(d, static_cast<std::uint8_t>(limit));
  V8 least = hn::Set(d, 255);
  std::size_t b = 0;
  for (; b + 2 <= block_count; b += 2) {
    compare_blocks<2>(code, blocks + b * kBytes, most, out + b * kBlockCodes, least);
  }
  if (b < block_count) {
    compare_blocks<1>(code, blocks + b * kBytes, most, out + b * kBlockCodes, least);
  }
  std::uint8_t lanes[hn::MaxLanes(D8())];
  hn::StoreU(least, d, lanes);
  int smallest = 255;
  for (int i = 0; i < lanes8(); ++i) smallest = lanes[i] < smallest ? lanes[i] : smallest;
  return smallest;
}

/// The image's gray values under the patch, row by row, then zeros.
void sample_patch(const PatchPlace& place, const std::uint8_t* pixels, std::ptrdiff_t stride,
                  float* out) {
  const hn::CappedTag<float, 4> d;
  const hn::RebindToSigned<decltype(d)> whole;
  const hn::Rebind<std::uint16_t, decltype(d)> halves;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(d));
  const auto x0 = hn::Set(d, place.x);
  const auto y0 = hn::Set(d, place.y);
  const auto right_x = hn::Set(d, place.right_x);
  const auto right_y = hn::Set(d, place.right_y);
  const auto down_x = hn::Set(d, place.down_x);
  const auto down_y = hn::Set(d, place.down_y);
  const auto row_bytes = hn::Set(whole, static_cast<std::int32_t>(stride));
  const auto low = hn::Set(whole, 255);
  for (int k = 0; k < kPatchPixels; k += kLanes) {
    const auto fu = hn::Load(d, kPatchOffsets.right + k);
    const auto fv = hn::Load(d, kPatchOffsets.down + k);
    const auto x = hn::Add(hn::Add(x0, hn::Mul(fv, down_x)), hn::Mul(fu, right_x));
    const auto y = hn::Add(hn::Add(y0, hn::Mul(fv, down_y)), hn::Mul(fu, right_y));
    const auto column = hn::ConvertTo(whole, x);
    const auto row = hn::ConvertTo(whole, y);
    alignas(16) std::int32_t offsets[kLanes];
    hn::Store(hn::Add(hn::Mul(row, row_bytes), column), whole, offsets);
    // A lane holds two neighbouring pixels, a byte each.
    alignas(16) std::uint16_t above[kLanes];
    alignas(16) std::uint16_t below[kLanes];
#pragma GCC unroll 4
    for (int i = 0; i < kLanes; ++i) {
      const std::uint8_t* p = pixels + offsets[i];
      std::memcpy(&above[i], p, sizeof above[i]);
      std::memcpy(&below[i], p + stride, sizeof below[i]);
    }
    const auto two_above = hn::PromoteTo(whole, hn::Load(halves, above));
    const auto two_below = hn::PromoteTo(whole, hn::Load(halves, below));
    const auto a = hn::ConvertTo(d, hn::And(two_above, low));
    const auto b = hn::ConvertTo(d, hn::ShiftRight<8>(two_above));
    const auto c = hn::ConvertTo(d, hn::And(two_below, low));
    const auto e = hn::ConvertTo(d, hn::ShiftRight<8>(two_below));
    const auto fx = hn::Sub(x, hn::ConvertTo(d, column));
    const auto fy = hn::Sub(y, hn::ConvertTo(d, row));
    const auto upper = hn::Add(a, hn::Mul(fx, hn::Sub(b, a)));
    const auto lower = hn::Add(c, hn::Mul(fx, hn::Sub(e, c)));
    hn::Store(hn::Add(upper, hn::Mul(fy, hn::Sub(lower, upper))), d, out + k);
  }
  for (int i = kPatchSide * kPatchSide; i < kPatchPixels; ++i) out[i] = 0.0f;
}

float sum_of_four(const float* lanes) {
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

PatchSums patch_sums(const PatchTemplate& patch, const PatchPlace& place,
                     const std::uint8_t* pixels, std::ptrdiff_t stride) {
  alignas(16) float seen[kPatchPixels];
  sample_patch(place, pixels, stride, seen);
  alignas(16) float lanes[5][4] = {};
#if HWY_TARGET != HWY_SCALAR
  const hn::FixedTag<float, 4> d;
  auto i = hn::Zero(d);
  auto ii = hn::Zero(d);
  auto ti = hn::Zero(d);
  auto ix = hn::Zero(d);
  auto iy = hn::Zero(d);
  for (int k = 0; k < kPatchPixels; k += 4) {
    const auto gray = hn::Load(d, seen + k);
    i = hn::Add(i, gray);
    ii = hn::Add(ii, hn::Mul(gray, gray));
    ti = hn::Add(ti, hn::Mul(gray, hn::Load(d, patch.gray + k)));
    ix = hn::Add(ix, hn::Mul(gray, hn::Load(d, patch.right + k)));
    iy = hn::Add(iy, hn::Mul(gray, hn::Load(d, patch.down + k)));
  }
  hn::Store(i, d, lanes[0]);
  hn::Store(ii, d, lanes[1]);
  hn::Store(ti, d, lanes[2]);
  hn::Store(ix, d, lanes[3]);
  hn::Store(iy, d, lanes[4]);
#else
  for (int k = 0; k < kPatchPixels; ++k) {
    const int lane = k & 3;
    lanes[0][lane] += seen[k];
    lanes[1][lane] += seen[k] * seen[k];
    lanes[2][lane] += seen[k] * patch.gray[k];
    lanes[3][lane] += seen[k] * patch.right[k];
    lanes[4][lane] += seen[k] * patch.down[k];
  }
#endif
  return {sum_of_four(lanes[0]), sum_of_four(lanes[1]), sum_of_four(lanes[2]),
          sum_of_four(lanes[3]), sum_of_four(lanes[4])};
}

constexpr Kernels table(const char* name) {
  return {name, halve_row, blur_columns, blur_row, corner_scores, peaks, distances, patch_sums};
}

}  // namespace modar::tracker::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace modar::tracker {

std::span<const Kernels> all_kernels() {
#if HWY_ARCH_X86 && (HWY_TARGETS & HWY_SSE4) && (HWY_TARGETS & HWY_AVX2)
#if HWY_STATIC_TARGET == HWY_SCALAR
  static constexpr Kernels kTables[] = {N_SCALAR::table("scalar"), N_SSE4::table("sse4"),
                                        N_AVX2::table("avx2")};
  constexpr std::size_t kBaseline = 1;
#else
  static constexpr Kernels kTables[] = {N_SSE4::table("sse4"), N_AVX2::table("avx2")};
  constexpr std::size_t kBaseline = 0;
#endif
  static const std::size_t count = kBaseline + static_cast<std::size_t>(x86_simd_level());
  return {kTables, count};
#else
  static constexpr Kernels kTables[] = {HWY_STATIC_DISPATCH(table)("baseline")};
  return kTables;
#endif
}

const Kernels& kernels(int level) {
  const auto all = all_kernels();
  const std::size_t last = all.size() - 1;
  return all[level < 0 ? last : std::min(static_cast<std::size_t>(level), last)];
}

}  // namespace modar::tracker
#endif  // HWY_ONCE
