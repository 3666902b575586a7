// The encoder of a batch of blocks, compiled for each SIMD level and chosen at run time.
#include "bake/texture/etc1/etc1_kernel.hpp"

// Machines without SSE4 take the plain integers: one level less to compile.
#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/texture/etc1/etc1_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

#include <hwy/highway.h>

#include "bake/texture/etc1/etc1_exact-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {

// The two quicker efforts: one walk for each half and mode, then a few steps by true errors.

HWY_INLINE V reach_of(const HalfStats& stats, int reach, int spread) {
  return hn::Add(set(reach), hn::Mul(load(stats.spread), set(spread)));
}
template <int kBits>
HWY_INLINE V reach_of(const HalfStats& stats, const Etc1Search& search) {
  return kBits == 5 ? reach_of(stats, search.reach5, search.spread5)
                    : reach_of(stats, search.reach4, search.spread4);
}

/// Clamps pairs of colours that differ too much to the steps of differential mode: the better
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

/// Black and white in any mixture: base colours of middle brightness with the largest table
/// reach both by clamping, which no estimate sees. Tries them where a half's brightness spans more
/// than 200 of 255. Black and white drawings (`modar-lab bench etc1`, `fast`): exact from 100 to
/// 200, 28 to 38 dB without; with a noise of 8 added 44.2 and 38.7 dB. Photos are the same without.
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

// The thorough effort: each table's best colour is a seed, refined by true errors until no step
// helps.

/// The best colour and table of a half within its bounds.
template <int kBits, class W>
HWY_NOINLINE void search_half(const Etc1Search& search, const HalfSite& site, HalfFit& fit) {
  HalfBest seed[8];
  sweep_tables<kBits, W>(site.stats, reach_of<kBits>(site.stats, search), site.low, site.high,
                         seed);
  store(set(0x7fffffff), fit.error);
  store(set(0), fit.colour);
  store(set(0), fit.table);
  for (std::size_t t = 0; t < 8; ++t) {
    const V table = set(static_cast<std::int32_t>(t));
    HalfFit grown;
    store(load(seed[t].colour), grown.colour);
    store(table, grown.table);
    store(true_error<kBits, W>(site, load(seed[t].colour), table), grown.error);
    try_steps<kBits, W>(site, load(seed[t].colour), table, 4, grown);
    keep_fit(hn::Lt(load(grown.error), load(fit.error)), load(grown.error), load(grown.colour),
             load(grown.table), fit);
  }
  for (int round = 0; round < search.rounds; ++round) {
    if (!refine_wide<kBits, W>(site, fit)) break;
  }
}

template <class W>
void thorough_individual(const Etc1Search& search, HalfSite (&site)[2], Choice& choice) {
  HalfFit fit[2];
  for (std::size_t half = 0; half < 2; ++half) {
    free_bounds<4>(site[half]);
    search_half<4, W>(search, site[half], fit[half]);
  }
  keep_better(hn::Add(load(fit[0].error), load(fit[1].error)), fit, false, site[0].flip, choice);
}

/// Searches one half freely and the other around it.
template <class W>
void thorough_differential(const Etc1Search& search, std::size_t leader, HalfSite (&site)[2],
                           Choice& choice) {
  const std::size_t other = 1 - leader;
  HalfFit fit[2];
  free_bounds<5>(site[leader]);
  search_half<5, W>(search, site[leader], fit[leader]);
  const std::int32_t below = leader == 0 ? -4 : -3;
  bounds_around(load(fit[leader].colour), below, below + 7, site[other]);
  search_half<5, W>(search, site[other], fit[other]);
  // Where the bounds hurt, the leader may have to give way.
  for (int round = 0; round < search.rounds; ++round) {
    const V before = hn::Add(load(fit[0].error), load(fit[1].error));
    bounds_around(load(fit[1].colour), -3, 4, site[0]);
    refine_wide<5, W>(site[0], fit[0]);
    bounds_around(load(fit[0].colour), -4, 3, site[1]);
    refine_wide<5, W>(site[1], fit[1]);
    const V after = hn::Add(load(fit[0].error), load(fit[1].error));
    if (all(hn::Eq(before, after))) break;
  }
  keep_better(hn::Add(load(fit[0].error), load(fit[1].error)), fit, true, site[0].flip, choice);
}

template <class W>
void encode_group(const Pixels& pixels, const Etc1Search& search, Row& high, Row& low) {
  PixelPairs pairs;
  pair_up(pixels, pairs);
  Choice choice;
  store(set(0x7fffffff), choice.error);
  for (const bool flip : {false, true}) {
    HalfStats stats[2];
    gather_stats<W>(pixels, flip, 0, stats[0]);
    gather_stats<W>(pixels, flip, 1, stats[1]);
    HalfSite site[2] = {{pairs, stats[0], flip, 0, {}, {}}, {pairs, stats[1], flip, 1, {}, {}}};
    if (search.thorough) {
      thorough_differential<W>(search, 0, site, choice);
      thorough_differential<W>(search, 1, site, choice);
      thorough_individual<W>(search, site, choice);
    } else {
      quick_mode<5, W>(search, site, choice);
      quick_mode<4, W>(search, site, choice);
    }
    try_extremes<W>(search, site, choice);
  }
  if (!search.exact) settle_tables<W>(pairs, choice);
  store(high_word(choice), high);
  store(low_word<W>(pairs, choice), low);
}

template <class W>
void encode_all(const Etc1BatchIn& in, const Etc1Search& search, Etc1BatchOut& out) {
  const Lanes d;
  const hn::RebindToUnsigned<Lanes> u;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t first = 0; first < kEtc1Batch; first += lanes) {
    Pixels pixels;
    for (std::size_t i = 0; i < 16; ++i) {
      const V rgba = hn::BitCast(d, hn::LoadU(u, in.pixels[i] + first));
      store(red_of(rgba), pixels.red[i]);
      store(green_of(rgba), pixels.green[i]);
      store(blue_of(rgba), pixels.blue[i]);
    }
    Row high;
    Row low;
    encode_group<W>(pixels, search, high, low);
    hn::StoreU(hn::BitCast(u, load(high)), u, out.high + first);
    hn::StoreU(hn::BitCast(u, load(low)), u, out.low + first);
  }
}

void encode_batch(const Etc1BatchIn& in, const Etc1Search& search, Etc1BatchOut& out) {
  if (search.perceptual) {
    encode_all<LumaWeights>(in, search, out);
  } else {
    encode_all<EqualWeights>(in, search, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace modar
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace modar {

HWY_EXPORT(encode_batch);

void encode_etc1_batch(const Etc1BatchIn& in, const Etc1Search& search, Etc1BatchOut& out) {
  HWY_DYNAMIC_DISPATCH(encode_batch)(in, search, out);
}

std::vector<std::int64_t> simd_levels() {
  return hwy::SupportedAndGeneratedTargets();
}

std::string simd_level_name(std::int64_t level) {
  return hwy::TargetName(level);
}

void force_simd_level(std::int64_t level) {
  hwy::SetSupportedTargetsForTest(level);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace modar
#endif  // HWY_ONCE
