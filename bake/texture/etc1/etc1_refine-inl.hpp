// Steps from good base colours to better ones, by true errors. Compiled once for each SIMD level.
#if defined(MODAR_ETC1_REFINE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef MODAR_ETC1_REFINE_INL
#undef MODAR_ETC1_REFINE_INL
#else
#define MODAR_ETC1_REFINE_INL
#endif

#include "bake/texture/etc1/etc1_exact-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {

/// Which half of which pixels a fit is for, and what its colour may be.
struct HalfSite {
  const PixelPairs& pixels;
  const HalfStats& stats;
  bool flip;
  std::size_t half;
  Triple low;
  Triple high;
};

template <int kBits>
HWY_INLINE void free_bounds(HalfSite& site) {
  for (std::size_t c = 0; c < 3; ++c) {
    store(set(0), site.low.c[c]);
    store(set(top_of<kBits>()), site.high.c[c]);
  }
}

/// Differential mode: the colour must lie from `below` to `above` the other half's.
HWY_INLINE void bounds_around(V colour, std::int32_t below, std::int32_t above, HalfSite& site) {
  const V q[3] = {red_of(colour), green_of(colour), blue_of(colour)};
  for (std::size_t c = 0; c < 3; ++c) {
    store(hn::Max(hn::Add(q[c], set(below)), set(0)), site.low.c[c]);
    store(hn::Min(hn::Add(q[c], set(above)), set(31)), site.high.c[c]);
  }
}

HWY_INLINE M within(V colour, const HalfSite& site) {
  const V q[3] = {red_of(colour), green_of(colour), blue_of(colour)};
  M inside = hn::Eq(colour, colour);
  for (std::size_t c = 0; c < 3; ++c) {
    inside = hn::And(
        inside, hn::And(at_most(load(site.low.c[c]), q[c]), at_most(q[c], load(site.high.c[c]))));
  }
  return inside;
}

template <int kBits, class W>
HWY_INLINE V true_error(const HalfSite& site, V colour, V table) {
  Palette palette;
  make_palette(widen<kBits>(red_of(colour)), widen<kBits>(green_of(colour)),
               widen<kBits>(blue_of(colour)), table, palette);
  return exact_error<W>(site.pixels, site.flip, site.half, palette);
}

HWY_INLINE void keep_fit(M better, V error, V colour, V table, HalfFit& fit) {
  store(hn::IfThenElse(better, error, load(fit.error)), fit.error);
  store(hn::IfThenElse(better, colour, load(fit.colour)), fit.colour);
  store(hn::IfThenElse(better, table, load(fit.table)), fit.table);
}

/// Takes a colour and table where they are legal and better.
template <int kBits, class W>
HWY_NOINLINE void try_fit(const HalfSite& site, V colour, V table, HalfFit& fit) {
  const M table_exists = hn::Eq(hn::And(table, set(7)), table);
  const M legal = hn::And(within(colour, site), table_exists);
  const V error = true_error<kBits, W>(site, colour, table);
  keep_fit(hn::And(legal, hn::Lt(error, load(fit.error))), error, colour, table, fit);
}

/// Steps of one value in one, three and two channels of a packed colour. A channel that leaves its
/// byte changes the next, and within() finds it out of bounds itself: 0 - 1 leaves 255.
inline constexpr std::int32_t kColourSteps[] = {0x000001, 0x000100, 0x010000, 0x010101,
                                                0x000101, 0x010100, 0x010001};

template <int kBits, class W>
HWY_INLINE void try_steps(const HalfSite& site, V colour, V table, std::size_t steps,
                          HalfFit& fit) {
  for (std::size_t i = 0; i < steps; ++i) {
    try_fit<kBits, W>(site, hn::Add(colour, set(kColourSteps[i])), table, fit);
    try_fit<kBits, W>(site, hn::Sub(colour, set(kColourSteps[i])), table, fit);
  }
}

/// One round: a step of one channel, or the next table.
template <int kBits, class W>
HWY_NOINLINE void refine_narrow(const HalfSite& site, HalfFit& fit) {
  const V colour = load(fit.colour);
  const V table = load(fit.table);
  try_steps<kBits, W>(site, colour, table, 3, fit);
  try_fit<kBits, W>(site, colour, hn::Sub(table, set(1)), fit);
  try_fit<kBits, W>(site, colour, hn::Add(table, set(1)), fit);
}

/// One round: steps of all kinds under the table, the one before and the one after. Tells whether
/// any lane is better off.
template <int kBits, class W>
HWY_NOINLINE bool refine_wide(const HalfSite& site, HalfFit& fit) {
  const V error = load(fit.error);
  const V colour = load(fit.colour);
  const V first_table = load(fit.table);
  for (std::int32_t t = -1; t <= 1; ++t) {
    const V table = hn::Add(first_table, set(t));
    try_fit<kBits, W>(site, colour, table, fit);
    try_steps<kBits, W>(site, colour, table, 7, fit);
  }
  return !hn::AllFalse(Lanes(), hn::Lt(load(fit.error), error));
}

}  // namespace HWY_NAMESPACE
}  // namespace modar
HWY_AFTER_NAMESPACE();

#endif  // toggle
