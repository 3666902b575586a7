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

/// The greatest of the least values of all 16 arcs of nine neighbours.
inline V8 best_arc(const V8* difference) {
  V8 two[16];
  V8 four[16];
  for (int k = 0; k < 16; ++k) two[k] = hn::Min(difference[k], difference[(k + 1) & 15]);
  for (int k = 0; k < 16; ++k) four[k] = hn::Min(two[k], two[(k + 2) & 15]);
  V8 best = hn::Min(hn::Min(four[0], four[4]), difference[8]);
  for (int k = 1; k < 16; ++k) {
    const V8 eight = hn::Min(four[k], four[(k + 4) & 15]);
    best = hn::Max(best, hn::Min(eight, difference[(k + 8) & 15]));
  }
  return best;
}

void corner_scores(const std::uint8_t* pixels, std::ptrdiff_t stride, int threshold, int count,
                   std::uint8_t* bright, std::uint8_t* score) {
  const D8 d;
  // Bresenham circle of radius 3, clockwise from above.
  const std::ptrdiff_t ring[16] = {-3 * stride, -3 * stride + 1, -2 * stride + 2, -stride + 3,
                                   3,           stride + 3,      2 * stride + 2,  3 * stride + 1,
                                   3 * stride,  3 * stride - 1,  2 * stride - 2,  stride - 3,
                                   -3,          -stride - 3,     -2 * stride - 2, -3 * stride - 1};
  const V8 zero = hn::Zero(d);
  const V8 least = hn::Set(d, static_cast<std::uint8_t>(threshold - 1));
  for (int i = 0; i < count; i += lanes8()) {
    const std::uint8_t* at = pixels + i;
    const V8 centre = hn::LoadU(d, at);
    V8 up[16];
    V8 down[16];
    for (int k = 0; k < 16; k += 4) {
      const V8 p = hn::LoadU(d, at + ring[k]);
      up[k] = hn::SaturatedSub(p, centre);
      down[k] = hn::SaturatedSub(centre, p);
    }
    // Nine in sequence contain one of each pair of opposite compass points.
    const V8 maybe_up = hn::Min(hn::Max(up[0], up[8]), hn::Max(up[4], up[12]));
    const V8 maybe_down = hn::Min(hn::Max(down[0], down[8]), hn::Max(down[4], down[12]));
    if (hn::AllFalse(d, hn::Gt(hn::Max(maybe_up, maybe_down), least))) {
      hn::StoreU(zero, d, bright + i);
      hn::StoreU(zero, d, score + i);
      continue;
    }
    for (int k = 0; k < 16; ++k) {
      if ((k & 3) == 0) continue;
      const V8 p = hn::LoadU(d, at + ring[k]);
      up[k] = hn::SaturatedSub(p, centre);
      down[k] = hn::SaturatedSub(centre, p);
    }
    const V8 best_up = best_arc(up);
    const V8 best = hn::Max(best_up, best_arc(down));
    const auto corner = hn::Gt(best, least);
    hn::StoreU(hn::IfThenElseZero(corner, best_up), d, bright + i);
    hn::StoreU(hn::IfThenElseZero(corner, best), d, score + i);
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

/// Adds the differing bits of bytes `first` to `last` of a block's codes.
inline V8 count_bits(const std::uint8_t* code, const std::uint8_t* block, int first, int last,
                     V8 sum) {
  const D8 d;
  for (int k = first; k < last; ++k) {
    const V8 differ = hn::Xor(hn::Set(d, code[k]), hn::LoadU(d, block + k * kBlockCodes));
    sum = hn::SaturatedAdd(sum, hn::PopulationCount(differ));
  }
  return sum;
}

int distances(const std::uint8_t* code, const std::uint8_t* blocks, std::size_t block_count,
              int reach, std::uint8_t* out) {
  const D8 d;
  const int step = lanes8() < kBlockCodes ? lanes8() : kBlockCodes;
  const V8 limit = hn::Set(d, static_cast<std::uint8_t>(reach));
  V8 least = hn::Set(d, 255);
  for (std::size_t b = 0; b < block_count; ++b) {
    const std::uint8_t* block = blocks + b * kBlockCodes * kCodeBytes;
    std::uint8_t* answer = out + b * kBlockCodes;
    V8 half[kBlockCodes];
    bool near = false;
    for (int i = 0, v = 0; i < kBlockCodes; i += step, ++v) {
      half[v] = count_bits(code, block + i, 0, kCodeBytes / 2, hn::Zero(d));
      near = near || !hn::AllFalse(d, hn::Eq(hn::Min(half[v], limit), half[v]));
    }
    for (int i = 0, v = 0; i < kBlockCodes; i += step, ++v) {
      const V8 distance =
          near ? count_bits(code, block + i, kCodeBytes / 2, kCodeBytes, half[v]) : hn::Set(d, 255);
      hn::StoreU(distance, d, answer + i);
      least = hn::Min(least, distance);
    }
  }
  std::uint8_t lanes[256] = {};
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
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int k = 0; k < kPatchPixels; k += lanes) {
    const auto fu = hn::Load(d, kPatchOffsets.right + k);
    const auto fv = hn::Load(d, kPatchOffsets.down + k);
    const auto at = [&](float centre, float right, float down) {
      return hn::Add(hn::Add(hn::Set(d, centre), hn::Mul(fv, hn::Set(d, down))),
                     hn::Mul(fu, hn::Set(d, right)));
    };
    const auto x = at(place.x, place.right_x, place.down_x);
    const auto y = at(place.y, place.right_y, place.down_y);
    const auto column = hn::ConvertTo(whole, x);
    const auto row = hn::ConvertTo(whole, y);
    alignas(16) std::int32_t columns[4];
    alignas(16) std::int32_t rows[4];
    hn::Store(column, whole, columns);
    hn::Store(row, whole, rows);
    // A lane holds the four neighbouring pixels, a byte each.
    alignas(16) std::int32_t four[4];
    for (int i = 0; i < lanes; ++i) {
      const std::uint8_t* p = pixels + rows[i] * stride + columns[i];
      std::uint16_t upper;
      std::uint16_t lower;
      std::memcpy(&upper, p, sizeof upper);
      std::memcpy(&lower, p + stride, sizeof lower);
      four[i] = static_cast<std::int32_t>(upper | static_cast<std::uint32_t>(lower) << 16);
    }
    const hn::RebindToUnsigned<decltype(d)> bits;
    const auto bytes = hn::BitCast(bits, hn::Load(whole, four));
    const auto low = hn::Set(bits, 255u);
    const auto gray = [&](auto value) { return hn::ConvertTo(d, hn::BitCast(whole, value)); };
    const auto a = gray(hn::And(bytes, low));
    const auto b = gray(hn::And(hn::ShiftRight<8>(bytes), low));
    const auto c = gray(hn::And(hn::ShiftRight<16>(bytes), low));
    const auto e = gray(hn::ShiftRight<24>(bytes));
    const auto fx = hn::Sub(x, hn::ConvertTo(d, column));
    const auto fy = hn::Sub(y, hn::ConvertTo(d, row));
    const auto upper = hn::Add(a, hn::Mul(fx, hn::Sub(b, a)));
    const auto lower = hn::Add(c, hn::Mul(fx, hn::Sub(e, c)));
    hn::Store(hn::Add(upper, hn::Mul(fy, hn::Sub(lower, upper))), d, out + k);
  }
  constexpr int kSide = 2 * kPatchHalf + 1;
  for (int i = kSide * kSide; i < kPatchPixels; ++i) out[i] = 0.0f;
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
#if HWY_ARCH_X86
#include <cpuid.h>
#endif

// Highway's own dispatch needs its shared library; this needs none.
namespace modar::tracker {

#if HWY_ARCH_X86 && (HWY_TARGETS & HWY_SSE4) && (HWY_TARGETS & HWY_AVX2)
namespace {

/// Clang 14 does not know the name in __builtin_cpu_supports().
bool has_f16c() {
  unsigned a = 0;
  unsigned b = 0;
  unsigned c = 0;
  unsigned d = 0;
  return __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_F16C) != 0;
}

}  // namespace
#endif

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
  // What Highway compiles for: SSE4 with carry-less multiplication, AVX2 with FMA and BMI2.
  static const std::size_t count = [] {
    __builtin_cpu_init();
    const bool sse4 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("pclmul") &&
                      __builtin_cpu_supports("aes");
    const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                      __builtin_cpu_supports("bmi2") && has_f16c();
    return kBaseline + (avx2 ? 2u : sse4 ? 1u : 0u);
  }();
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
