// The search for base colours and tables of half blocks, under the assumption that no channel of
// the result leaves 0-255. Compiled once for each SIMD level.
//
// For a pixel p, a base colour B and a modifier m of all channels, with weights w of sum W:
//   W * sum_c w_c (p_c - B_c - m)^2 = sum_{c<d} w_c w_d ((p_c - B_c) - (p_d - B_d))^2 + (s - W
//   m)^2, s = sum_c w_c (p_c - B_c).
// So modifiers compete in one dimension, and for given modifiers each channel of the best B is the
// value nearest to the half's mean less the modifiers' mean: all colours that can be best are on
// the path that the nearest values take while that mean moves. sweep() walks it.
#if defined(MODAR_ETC1_SEARCH_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef MODAR_ETC1_SEARCH_INL
#undef MODAR_ETC1_SEARCH_INL
#else
#define MODAR_ETC1_SEARCH_INL
#endif

#include "bake/texture/etc1/etc1_lanes-inl.hpp"
#include "formats/etc1.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {

/// Weights of red, green and blue in an error.
struct EqualWeights {
  static constexpr std::int32_t kRed = 1, kGreen = 1, kBlue = 1, kSum = 3;
};
struct LumaWeights {
  static constexpr std::int32_t kRed = 3, kGreen = 6, kBlue = 1, kSum = 10;
};

/// Three channels of quantised values, or of bounds of them.
struct Triple {
  Row c[3];
};

/// What the search knows of one half.
struct HalfStats {
  Row bright[4];  ///< pairs of twice the weighted sum of a pixel's channels
  Triple sum;     ///< of the eight pixels
  Row constant;   ///< the part of the cost that no choice changes
  Row spread;     ///< weighted brightness, greatest less smallest
};

/// Best colour so far of a half, and its cost (see half_cost()).
struct HalfBest {
  Row cost;
  Row colour;  ///< quantised red, green, blue in bits 0-7, 8-15, 16-23
};

HWY_INLINE V red_of(V packed) {
  return hn::And(packed, set(255));
}
HWY_INLINE V green_of(V packed) {
  return hn::And(hn::ShiftRight<8>(packed), set(255));
}
HWY_INLINE V blue_of(V packed) {
  return hn::And(hn::ShiftRight<16>(packed), set(255));
}
HWY_INLINE V pack_colour(V r, V g, V b) {
  return hn::Or(r, hn::Or(hn::ShiftLeft<8>(g), hn::ShiftLeft<16>(b)));
}

/// 8-bit value of a quantised channel.
template <int kBits>
HWY_INLINE V widen(V q) {
  if constexpr (kBits == 5) return hn::Or(hn::ShiftLeft<3>(q), hn::ShiftRight<2>(q));
  return hn::Or(hn::ShiftLeft<4>(q), q);
}
template <int kBits>
constexpr std::int32_t top_of() {
  return kBits == 5 ? 31 : 15;
}

/// Quantised value near a sum of eight 8-bit values; x is clamped to 0-2040 first.
template <int kBits>
HWY_INLINE V quantise8(V x) {
  const V in = clamp(x, set(0), set(2040));
  // (in * top + 1020) / 2040, the division by a multiplication that is exact over this range.
  const V scaled = hn::Add(hn::Mul(in, set(top_of<kBits>())), set(1020));
  return hn::ShiftRight<26>(hn::Mul(scaled, set(32897)));
}

/// Pixel `k` (0-7) of half `half`, counted in rows of the block.
constexpr std::size_t pixel_of(bool flip, std::size_t half, std::size_t k) {
  return flip ? 8 * half + k : 4 * (k / 2) + 2 * half + k % 2;
}

template <class W>
HWY_INLINE V squares_of_differences(V r, V g, V b) {
  const V rg = hn::Sub(r, g);
  const V gb = hn::Sub(g, b);
  const V br = hn::Sub(b, r);
  if constexpr (W::kSum == 3) {
    return hn::Add(square_sum(as_pairs(pack(rg, gb))),
                   square_sum(as_pairs(hn::And(br, set(0xffff)))));
  }
  return hn::Add(hn::Mul(hn::Mul(rg, rg), set(W::kRed * W::kGreen)),
                 hn::Add(hn::Mul(hn::Mul(gb, gb), set(W::kGreen * W::kBlue)),
                         hn::Mul(hn::Mul(br, br), set(W::kBlue * W::kRed))));
}

/// Pixels of a group of blocks, a lane a block.
struct Pixels {
  Row red[16];
  Row green[16];
  Row blue[16];
};

template <class W>
HWY_NOINLINE void gather_stats(const Pixels& pixels, bool flip, std::size_t half,
                               HalfStats& stats) {
  V red = set(0);
  V green = set(0);
  V blue = set(0);
  V squares = set(0);
  V lowest = set(1 << 20);
  V highest = set(0);
  V last = set(0);
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t i = pixel_of(flip, half, k);
    const V r = load(pixels.red[i]);
    const V g = load(pixels.green[i]);
    const V b = load(pixels.blue[i]);
    const V bright = hn::Add(hn::Mul(r, set(W::kRed)),
                             hn::Add(hn::Mul(g, set(W::kGreen)), hn::Mul(b, set(W::kBlue))));
    if (k % 2 == 1) store(hn::ShiftLeft<1>(pack(last, bright)), stats.bright[k / 2]);
    last = bright;
    lowest = hn::Min(lowest, bright);
    highest = hn::Max(highest, bright);
    red = hn::Add(red, r);
    green = hn::Add(green, g);
    blue = hn::Add(blue, b);
    squares = hn::Add(squares, squares_of_differences<W>(r, g, b));
  }
  store(red, stats.sum.c[0]);
  store(green, stats.sum.c[1]);
  store(blue, stats.sum.c[2]);
  store(hn::Sub(hn::ShiftLeft<3>(squares), squares_of_differences<W>(red, green, blue)),
        stats.constant);
  store(hn::Sub(highest, lowest), stats.spread);
}

/// 4 * (s - W m)^2, summed over the half, for the best m of each pixel under one table.
template <class W>
HWY_INLINE V table_cost(const Pairs (&distance)[4], std::size_t table) {
  const std::int32_t small = kEtc1Modifiers[table][0];
  const std::int32_t large = kEtc1Modifiers[table][1];
  const Pairs middle = pairs_of(W::kSum * (small + large));
  const Pairs half_gap = pairs_of(W::kSum * (large - small));
  V cost = set(0);
  for (std::size_t k = 0; k < 4; ++k) {
    const Pairs left = subtract(absolute(subtract(distance[k], middle)), half_gap);
    cost = hn::Add(cost, square_sum(left));
  }
  return cost;
}

template <class W>
HWY_INLINE void distances(const HalfStats& stats, V r, V g, V b, Pairs (&distance)[4]) {
  const V bright = hn::Add(hn::Mul(r, set(W::kRed)),
                           hn::Add(hn::Mul(g, set(W::kGreen)), hn::Mul(b, set(W::kBlue))));
  const V twice = hn::ShiftLeft<1>(bright);
  const Pairs both = as_pairs(pack(twice, twice));
  for (std::size_t k = 0; k < 4; ++k) {
    distance[k] = absolute(subtract(as_pairs(load(stats.bright[k])), both));
  }
}

/// What a base colour (8-bit values) costs besides its table.
template <class W>
HWY_INLINE V colour_cost(const HalfStats& stats, V r, V g, V b) {
  return squares_of_differences<W>(hn::Sub(load(stats.sum.c[0]), hn::ShiftLeft<3>(r)),
                                   hn::Sub(load(stats.sum.c[1]), hn::ShiftLeft<3>(g)),
                                   hn::Sub(load(stats.sum.c[2]), hn::ShiftLeft<3>(b)));
}

/// Cost of a base colour under its best table; with stats.constant, 8 * W times the half's error.
template <class W>
HWY_INLINE V half_cost(const HalfStats& stats, V r, V g, V b) {
  Pairs distance[4];
  distances<W>(stats, r, g, b, distance);
  V best = table_cost<W>(distance, 0);
  for (std::size_t table = 1; table < 8; ++table) {
    best = hn::Min(best, table_cost<W>(distance, table));
  }
  return hn::Add(colour_cost<W>(stats, r, g, b), hn::ShiftLeft<1>(best));
}

/// The table that half_cost() took: the first of the best.
template <class W>
HWY_NOINLINE V best_table(const HalfStats& stats, V r, V g, V b) {
  Pairs distance[4];
  distances<W>(stats, r, g, b, distance);
  V best = table_cost<W>(distance, 0);
  V which = set(0);
  for (std::size_t table = 1; table < 8; ++table) {
    const V cost = table_cost<W>(distance, table);
    which = hn::IfThenElse(hn::Lt(cost, best), set(static_cast<std::int32_t>(table)), which);
    best = hn::Min(best, cost);
  }
  return which;
}

/// Moves q to its next value where that is the nearest step of the three channels.
HWY_INLINE V advance(V q, V step, V nearest, M active) {
  const M mine = hn::And(hn::Eq(step, nearest), active);
  return hn::Add(q, hn::IfThenElseZero(mine, set(1)));
}

/// How far (in sums of eight pixels) the path must go for this channel to change.
template <int kBits>
HWY_INLINE V step_of(V q, V wide, V sum, V high) {
  const V next = widen<kBits>(hn::Add(q, set(1)));
  const V step = hn::Sub(hn::ShiftLeft<2>(hn::Add(wide, next)), sum);
  return hn::IfThenElse(hn::Lt(q, high), step, set(1 << 20));
}

/// Walks the path of nearest colours from `reach` below the mean to `reach` above it, within
/// bounds, and shows each colour to visit(red, green, blue, q), the first three as 8-bit values, q
/// packed.
template <int kBits, class Visit>
HWY_INLINE void walk(const HalfStats& stats, V reach, const Triple& low, const Triple& high,
                     const Visit& visit) {
  V q[3];
  for (std::size_t c = 0; c < 3; ++c) {
    q[c] = clamp(quantise8<kBits>(hn::Sub(load(stats.sum.c[c]), reach)), load(low.c[c]),
                 load(high.c[c]));
  }
  for (;;) {
    const V r = widen<kBits>(q[0]);
    const V g = widen<kBits>(q[1]);
    const V b = widen<kBits>(q[2]);
    visit(r, g, b, pack_colour(q[0], q[1], q[2]));
    const V step_r = step_of<kBits>(q[0], r, load(stats.sum.c[0]), load(high.c[0]));
    const V step_g = step_of<kBits>(q[1], g, load(stats.sum.c[1]), load(high.c[1]));
    const V step_b = step_of<kBits>(q[2], b, load(stats.sum.c[2]), load(high.c[2]));
    const V nearest = hn::Min(step_r, hn::Min(step_g, step_b));
    const M active = at_most(nearest, reach);
    if (hn::AllFalse(Lanes(), active)) return;
    q[0] = advance(q[0], step_r, nearest, active);
    q[1] = advance(q[1], step_g, nearest, active);
    q[2] = advance(q[2], step_b, nearest, active);
  }
}

HWY_INLINE void keep_colour(V cost, V colour, HalfBest& best) {
  const V before = load(best.cost);
  store(hn::IfThenElse(hn::Lt(cost, before), colour, load(best.colour)), best.colour);
  store(hn::Min(cost, before), best.cost);
}

/// The best colour of the path, under whichever table.
template <int kBits, class W>
HWY_NOINLINE void sweep(const HalfStats& stats, V reach, const Triple& low, const Triple& high,
                        HalfBest& best) {
  store(set(0x7fffffff), best.cost);
  store(set(0), best.colour);
  walk<kBits>(stats, reach, low, high, [&](V r, V g, V b, V q) HWY_ATTR {
    keep_colour(half_cost<W>(stats, r, g, b), q, best);
  });
}

/// The best colour of the path for each table.
template <int kBits, class W>
HWY_NOINLINE void sweep_tables(const HalfStats& stats, V reach, const Triple& low,
                               const Triple& high, HalfBest (&best)[8]) {
  for (HalfBest& each : best) {
    store(set(0x7fffffff), each.cost);
    store(set(0), each.colour);
  }
  walk<kBits>(stats, reach, low, high, [&](V r, V g, V b, V q) HWY_ATTR {
    Pairs distance[4];
    distances<W>(stats, r, g, b, distance);
    const V colour = colour_cost<W>(stats, r, g, b);
    for (std::size_t table = 0; table < 8; ++table) {
      const V cost = table_cost<W>(distance, table);
      keep_colour(hn::Add(colour, hn::ShiftLeft<1>(cost)), q, best[table]);
    }
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace modar
HWY_AFTER_NAMESPACE();

#endif  // toggle
