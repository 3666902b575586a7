// The thorough effort: each table's best colour is a seed, refined by true errors until no step
// helps. Compiled once for each SIMD level.
#if defined(MODAR_ETC1_THOROUGH_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef MODAR_ETC1_THOROUGH_INL
#undef MODAR_ETC1_THOROUGH_INL
#else
#define MODAR_ETC1_THOROUGH_INL
#endif

#include "bake/texture/etc1/etc1_quick-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {

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

}  // namespace HWY_NAMESPACE
}  // namespace modar
HWY_AFTER_NAMESPACE();

#endif  // toggle
