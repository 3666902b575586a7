// Bilinear samples by one gather each, and Hamming distances, compiled for each SIMD level.
#include "runtime/record/view_kernel.hpp"
#include "modar/pattern_views.hpp"

// Levels that gain little here.
#define HWY_DISABLED_TARGETS \
  (HWY_SSSE3 | HWY_AVX3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/record/view_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

#include <algorithm>
#include <bit>
#include <cstring>

#include <hwy/highway.h>

#include "formats/base/simd_level.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::ScalableTag<std::int32_t>;
using Words = hn::RebindToUnsigned<Lanes>;
using V = hn::Vec<Lanes>;

constexpr std::size_t kMostLanes = 16;  // of any level above

/// A place along one axis: the pixel before it, and how far behind that in 256ths.
struct Cell {
  V before;
  V part;
};

inline Cell cell_of(V place, int size) {
  const Lanes d;
  const V inside = hn::Min(hn::Max(place, hn::Zero(d)), hn::Set(d, (size - 1) << 16));
  const V before = hn::Min(hn::ShiftRight<16>(inside), hn::Set(d, size - 2));
  return {before, hn::ShiftRight<8>(hn::Sub(inside, hn::ShiftLeft<16>(before)))};
}

/// A weighted sum of four pixels with 16 bits after the point.
inline V sample(const ViewSamples& from, V x, V y) {
  const Lanes d;
  const Words words;
  const Cell column = cell_of(x, from.width);
  const Cell row = cell_of(y, from.height);
  const V index = hn::Add(hn::Mul(row.before, hn::Set(d, from.width)), column.before);
  const auto quad = hn::GatherIndex(words, from.quads, index);
  // Upper and lower pixels side by side in the halves of a word: no sum of theirs passes 255 * 256.
  const auto mask = hn::Set(words, 0x00FF00FF);
  const auto part = hn::BitCast(words, column.part);
  const auto left = hn::Mul(hn::And(quad, mask), hn::Sub(hn::Set(words, 256), part));
  const auto right = hn::Mul(hn::And(hn::ShiftRight<8>(quad), mask), part);
  const auto mixed = hn::Add(left, right);
  const V top = hn::BitCast(d, hn::And(mixed, hn::Set(words, 0xFFFF)));
  const V bottom = hn::BitCast(d, hn::ShiftRight<16>(mixed));
  return hn::Add(hn::ShiftLeft<8>(top), hn::Mul(row.part, hn::Sub(bottom, top)));
}

inline V sums_of(const ViewSamples& from, V x, V y) {
  const Lanes d;
  V sum = hn::Zero(d);
  for (const auto& [dx, dy] : from.offsets) {
    sum = hn::Add(sum, sample(from, hn::Add(x, hn::Set(d, dx)), hn::Add(y, hn::Set(d, dy))));
  }
  return sum;
}

inline void sample_all(const ViewSamples& from, const std::int32_t* x, const std::int32_t* y,
                       std::size_t count, std::uint8_t* out) {
  const Lanes d;
  const std::size_t step = hn::Lanes(d);
  // Quotients without a division: exact for sums below 2^30 and divisors below 2^6.
  const auto parts = static_cast<std::uint64_t>(from.offsets.size());
  const std::uint64_t inverse = ((std::uint64_t{1} << 36) + parts - 1) / parts;
  std::int32_t sums[kMostLanes];
  for (std::size_t first = 0; first < count; first += step) {
    const std::size_t some = std::min(step, count - first);
    if (some == step) {
      hn::StoreU(sums_of(from, hn::LoadU(d, x + first), hn::LoadU(d, y + first)), d, sums);
    } else {
      std::int32_t last_x[kMostLanes] = {};
      std::int32_t last_y[kMostLanes] = {};
      std::copy_n(x + first, some, last_x);
      std::copy_n(y + first, some, last_y);
      hn::StoreU(sums_of(from, hn::LoadU(d, last_x), hn::LoadU(d, last_y)), d, sums);
    }
    for (std::size_t i = 0; i < some; ++i) {
      const std::uint64_t mean = (static_cast<std::uint64_t>(sums[i]) * inverse) >> 36;
      out[first + i] = static_cast<std::uint8_t>((mean + 0x8000) >> 16);
    }
  }
}

inline void distances_to(const std::array<std::uint8_t, 32>& code,
                         const std::array<std::uint8_t, 32>* codes, const std::uint32_t* which,
                         std::size_t count, int* out) {
  std::uint64_t a[4];
  std::memcpy(a, code.data(), sizeof a);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t b[4];
    std::memcpy(b, codes[which != nullptr ? which[i] : i].data(), sizeof b);
    out[i] = std::popcount(a[0] ^ b[0]) + std::popcount(a[1] ^ b[1]) + std::popcount(a[2] ^ b[2]) +
             std::popcount(a[3] ^ b[3]);
  }
}

inline ViewLoops loops() {
  return {sample_all, distances_to};
}

}  // namespace HWY_NAMESPACE
}  // namespace modar
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace modar {
namespace {

const ViewLoops& best_loops() {
#if HWY_ARCH_X86 && (HWY_TARGETS & HWY_SSE4) && (HWY_TARGETS & HWY_AVX2)
#if HWY_STATIC_TARGET == HWY_SCALAR
  static const ViewLoops kBaseline = N_SCALAR::loops();
#else
  static const ViewLoops kBaseline = N_SSE4::loops();
#endif
  static const ViewLoops kLevels[] = {kBaseline, N_SSE4::loops(), N_AVX2::loops()};
  static const int level = x86_simd_level();
  return kLevels[level];
#else
  static const ViewLoops kLoops = HWY_STATIC_DISPATCH(loops)();
  return kLoops;
#endif
}

}  // namespace

void sample_pixels(const ViewSamples& samples, const std::int32_t* x, const std::int32_t* y,
                   std::size_t count, std::uint8_t* out) {
  best_loops().sample(samples, x, y, count, out);
}

void code_distances(const std::array<std::uint8_t, 32>& code,
                    const std::array<std::uint8_t, 32>* codes, const std::uint32_t* which,
                    std::size_t count, int* out) {
  best_loops().distances(code, codes, which, count, out);
}

}  // namespace modar
#endif  // HWY_ONCE
