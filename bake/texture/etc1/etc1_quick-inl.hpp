// The two quicker efforts: one walk for each half and mode, then a few steps by true errors.
// Compiled once for each SIMD level.
#if defined(MODAR_ETC1_QUICK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef MODAR_ETC1_QUICK_INL
#undef MODAR_ETC1_QUICK_INL
#else
#define MODAR_ETC1_QUICK_INL
#endif

#include "bake/texture/etc1/etc1_refine-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {

HWY_INLINE V reach_of(const HalfStats& stats, int reach, int spread) {
  return hn::Add(set(reach), hn::Mul(load(stats.spread), set(spread)));
}
template <int kBits>
HWY_INLINE V reach_of(const HalfStats& stats, const Etc1Search& search) {
  return kBits == 5 ? reach_of(stats, search.reach5, search.spread5)
                    : reach_of(stats, search.reach4, search.spread4);
}

/// Brings pairs of colours that differ too much within the steps of differential mode: the better
/// of keeping the first and bounding the second, or the other way round.
template <class W>
HWY_NOINLINE void bound_differential(const Etc1Search& search, HalfSite (&site)[2],
                                     HalfBest (&best)[2]) {
  const V first = load(best[0].colour);
  const V second = load(best[1].colour);
  bounds_around(first, -4, 3, site[1]);
  const M legal = within(second, site[1]);
  if (all(legal)) return;
  bounds_around(second, -3, 4, site[0]);
  HalfBest bounded[2];
  for (std::size_t half = 0; half < 2; ++half) {
    const HalfSite& s = site[half];
    sweep<5, W>(s.stats, reach_of<5>(s.stats, search), s.low, s.high, bounded[half]);
  }
  const V keep_first = hn::Add(load(best[0].cost), load(bounded[1].cost));
  const V keep_second = hn::Add(load(bounded[0].cost), load(best[1].cost));
  const M first_wins = at_most(keep_first, keep_second);
  const M change[2] = {hn::AndNot(legal, hn::Not(first_wins)), hn::AndNot(legal, first_wins)};
  for (std::size_t half = 0; half < 2; ++half) {
    HalfBest& to = best[half];
    store(hn::IfThenElse(change[half], load(bounded[half].cost), load(to.cost)), to.cost);
    store(hn::IfThenElse(change[half], load(bounded[half].colour), load(to.colour)), to.colour);
  }
}

/// Lets each half's bounds follow the other's colour, and takes a step.
template <int kBits, class W>
HWY_INLINE void refine_both(HalfSite (&site)[2], HalfFit (&fit)[2]) {
  if (kBits == 5) bounds_around(load(fit[1].colour), -3, 4, site[0]);
  refine_narrow<kBits, W>(site[0], fit[0]);
  if (kBits == 5) bounds_around(load(fit[0].colour), -4, 3, site[1]);
  refine_narrow<kBits, W>(site[1], fit[1]);
}

/// Adds the best blocks of one mode and flip to the choice.
template <int kBits, class W>
HWY_NOINLINE void quick_mode(const Etc1Search& search, HalfSite (&site)[2], Choice& choice) {
  HalfBest best[2];
  for (std::size_t half = 0; half < 2; ++half) {
    HalfSite& s = site[half];
    free_bounds<kBits>(s);
    sweep<kBits, W>(s.stats, reach_of<kBits>(s.stats, search), s.low, s.high, best[half]);
  }
  if (kBits == 5) bound_differential<W>(search, site, best);
  HalfFit fit[2];
  for (std::size_t half = 0; half < 2; ++half) {
    const V colour = load(best[half].colour);
    const V table = best_table<W>(site[half].stats, widen<kBits>(red_of(colour)),
                                  widen<kBits>(green_of(colour)), widen<kBits>(blue_of(colour)));
    store(colour, fit[half].colour);
    store(table, fit[half].table);
    store(search.exact ? true_error<kBits, W>(site[half], colour, table)
                       : hn::Add(load(best[half].cost), load(site[half].stats.constant)),
          fit[half].error);
  }
  for (int round = 0; round < search.rounds; ++round) refine_both<kBits, W>(site, fit);
  keep_better(hn::Add(load(fit[0].error), load(fit[1].error)), fit, kBits == 5, site[0].flip,
              choice);
}

/// Black beside white in any mixture: base colours of middle brightness with the largest table
/// reach both by clamping, which no estimate sees. Tries them where a half has such contrast.
template <class W>
HWY_NOINLINE void try_extremes(const Etc1Search& search, const HalfSite (&site)[2],
                               Choice& choice) {
  const V spread = hn::Max(load(site[0].stats.spread), load(site[1].stats.spread));
  const M extreme = hn::Gt(spread, set(200 * W::kSum));
  if (hn::AllFalse(Lanes(), extreme)) return;
  HalfFit fit[2];
  V error = set(0);
  for (std::size_t half = 0; half < 2; ++half) {
    V q[3];
    for (std::size_t c = 0; c < 3; ++c) {
      q[c] = clamp(quantise8<4>(load(site[half].stats.sum.c[c])), set(5), set(10));
    }
    const V colour = pack_colour(q[0], q[1], q[2]);
    store(colour, fit[half].colour);
    store(set(7), fit[half].table);
    error = hn::Add(error, true_error<4, W>(site[half], colour, set(7)));
  }
  // Without exact comparisons, the choice's error is an estimate in the units of costs.
  if (!search.exact) error = hn::Mul(error, set(8 * W::kSum));
  keep_better(hn::IfThenElse(extreme, error, set(0x7fffffff)), fit, false, site[0].flip, choice);
}

/// Estimates know nothing of clamping, which favours larger modifiers: black with white wants the
/// largest table. Takes each half's next table where its true error is smaller.
template <class W>
void settle_tables(const PixelPairs& pixels, Choice& choice) {
  const M differential = hn::Eq(load(choice.differential), set(1));
  const M flipped = hn::Eq(load(choice.flip), set(1));
  for (std::size_t half = 0; half < 2; ++half) {
    const V colour = load(choice.colour[half]);
    const V table = load(choice.table[half]);
    const V next = hn::Min(hn::Add(table, set(1)), set(7));
    V error[2];
    for (std::size_t i = 0; i < 2; ++i) {
      Palette palette;
      make_palette(widen_either(red_of(colour), differential),
                   widen_either(green_of(colour), differential),
                   widen_either(blue_of(colour), differential), i == 0 ? table : next, palette);
      error[i] = hn::IfThenElse(flipped, exact_error<W>(pixels, true, half, palette),
                                exact_error<W>(pixels, false, half, palette));
    }
    store(hn::IfThenElse(hn::Lt(error[1], error[0]), next, table), choice.table[half]);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace modar
HWY_AFTER_NAMESPACE();

#endif  // toggle
