// Vectors of the ETC1 encoder: a lane is a block; pairs of 16-bit numbers share a lane of 32.
// Compiled once for each SIMD level, hence the guard that toggles.
#if defined(MODAR_ETC1_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef MODAR_ETC1_LANES_INL
#undef MODAR_ETC1_LANES_INL
#else
#define MODAR_ETC1_LANES_INL
#endif

#include <hwy/highway.h>

#include "bake/texture/etc1/etc1_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

inline constexpr std::size_t kMaxLanes = 16;
using Lanes = hn::CappedTag<std::int32_t, kMaxLanes>;
using V = hn::Vec<Lanes>;
using M = hn::Mask<Lanes>;
/// A vector in memory.
struct alignas(64) Row {
  std::int32_t lane[kMaxLanes];
};

HWY_INLINE V set(std::int32_t value) {
  return hn::Set(Lanes(), value);
}
HWY_INLINE V load(const Row& row) {
  return hn::Load(Lanes(), row.lane);
}
HWY_INLINE void store(V value, Row& row) {
  hn::Store(value, Lanes(), row.lane);
}
HWY_INLINE V clamp(V value, V low, V high) {
  return hn::Min(hn::Max(value, low), high);
}
HWY_INLINE bool all(M mask) {
  return hn::AllTrue(Lanes(), mask);
}
HWY_INLINE M at_most(V a, V b) {
  return hn::Not(hn::Gt(a, b));
}

#if HWY_TARGET == HWY_SCALAR
/// Without vectors, the two 16-bit numbers of a lane are two integers.
struct Pairs {
  std::int32_t low;
  std::int32_t high;
};
HWY_INLINE Pairs as_pairs(V packed) {
  const std::int32_t both = hn::GetLane(packed);
  return {static_cast<std::int16_t>(both & 0xffff), both >> 16};
}
HWY_INLINE Pairs pairs_of(std::int32_t value) {
  return {value, value};
}
HWY_INLINE Pairs subtract(Pairs a, Pairs b) {
  return {a.low - b.low, a.high - b.high};
}
HWY_INLINE Pairs add(Pairs a, Pairs b) {
  return {a.low + b.low, a.high + b.high};
}
HWY_INLINE Pairs absolute(Pairs a) {
  return {a.low < 0 ? -a.low : a.low, a.high < 0 ? -a.high : a.high};
}
HWY_INLINE Pairs to_bytes(Pairs a) {
  return {HWY_MIN(HWY_MAX(a.low, 0), 255), HWY_MIN(HWY_MAX(a.high, 0), 255)};
}
HWY_INLINE V product_sum(Pairs a, Pairs b) {
  return set(a.low * b.low + a.high * b.high);
}
HWY_INLINE Pairs multiply(Pairs a, Pairs b) {
  return {a.low * b.low, a.high * b.high};
}
#else
using Lanes16 = hn::Repartition<std::int16_t, Lanes>;
using Pairs = hn::Vec<Lanes16>;
HWY_INLINE Pairs as_pairs(V packed) {
  return hn::BitCast(Lanes16(), packed);
}
HWY_INLINE Pairs pairs_of(std::int32_t value) {
  return hn::Set(Lanes16(), static_cast<std::int16_t>(value));
}
HWY_INLINE Pairs subtract(Pairs a, Pairs b) {
  return hn::Sub(a, b);
}
HWY_INLINE Pairs add(Pairs a, Pairs b) {
  return hn::Add(a, b);
}
HWY_INLINE Pairs absolute(Pairs a) {
  return hn::Abs(a);
}
HWY_INLINE Pairs to_bytes(Pairs a) {
  return hn::Min(hn::Max(a, pairs_of(0)), pairs_of(255));
}
HWY_INLINE Pairs multiply(Pairs a, Pairs b) {
  return hn::Mul(a, b);
}
/// Sum over each lane of the products of its two pairs.
HWY_INLINE V product_sum(Pairs a, Pairs b) {
#if HWY_ARCH_X86
  // x86 has this very instruction; Highway leaves the order of the sums open elsewhere.
  V unused = set(0);
  return hn::ReorderWidenMulAccumulate(Lanes(), a, b, set(0), unused);
#else
  const V a32 = hn::BitCast(Lanes(), a);
  const V b32 = hn::BitCast(Lanes(), b);
  const V high = hn::Mul(hn::ShiftRight<16>(a32), hn::ShiftRight<16>(b32));
  const V low = hn::Mul(hn::ShiftRight<16>(hn::ShiftLeft<16>(a32)),
                        hn::ShiftRight<16>(hn::ShiftLeft<16>(b32)));
  return hn::Add(low, high);
#endif
}
#endif

HWY_INLINE V square_sum(Pairs a) {
  return product_sum(a, a);
}
/// Two numbers of 16 bits in one lane.
HWY_INLINE V pack(V low, V high) {
  return hn::Or(hn::And(low, set(0xffff)), hn::ShiftLeft<16>(high));
}

}  // namespace HWY_NAMESPACE
}  // namespace modar
HWY_AFTER_NAMESPACE();

#endif  // toggle
