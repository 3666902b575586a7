// True errors of half blocks, clamping included, the codes of their pixels, the block's bits, and
// steps from good base colours to better ones. Compiled once for each SIMD level.
#if defined(MODAR_ETC1_EXACT_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef MODAR_ETC1_EXACT_INL
#undef MODAR_ETC1_EXACT_INL
#else
#define MODAR_ETC1_EXACT_INL
#endif

#include "bake/texture/etc1/etc1_search-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace modar {
namespace HWY_NAMESPACE {

/// Pixels as pairs: red with green, blue with nothing.
struct PixelPairs {
  Row red_green[16];
  Row blue[16];
};

HWY_INLINE void pair_up(const Pixels& pixels, PixelPairs& pairs) {
  for (std::size_t i = 0; i < 16; ++i) {
    store(pack(load(pixels.red[i]), load(pixels.green[i])), pairs.red_green[i]);
    store(load(pixels.blue[i]), pairs.blue[i]);
  }
}

/// The four colours that a half can show.
struct Palette {
  Pairs red_green[4];
  Pairs blue[4];
};

/// Modifier of each lane's table: index 0 the small one, 1 the large one.
HWY_INLINE V modifier_of(V table, std::size_t index) {
  V value = set(kEtc1Modifiers[0][index]);
  for (std::size_t t = 1; t < 8; ++t) {
    value = hn::IfThenElse(hn::Eq(table, set(static_cast<std::int32_t>(t))),
                           set(kEtc1Modifiers[t][index]), value);
  }
  return value;
}

HWY_NOINLINE void make_palette(V r, V g, V b, V table, Palette& palette) {
  const Pairs red_green = as_pairs(pack(r, g));
  const Pairs blue = as_pairs(b);
  for (std::size_t index = 0; index < 2; ++index) {
    const V size = modifier_of(table, index);
    const Pairs both = as_pairs(pack(size, size));
    const Pairs one = as_pairs(size);
    palette.red_green[index] = to_bytes(add(red_green, both));
    palette.blue[index] = to_bytes(add(blue, one));
    palette.red_green[index + 2] = to_bytes(subtract(red_green, both));
    palette.blue[index + 2] = to_bytes(subtract(blue, one));
  }
}

template <class W>
HWY_INLINE V colour_error(Pairs red_green, Pairs blue) {
  if constexpr (W::kSum == 3) return hn::Add(square_sum(red_green), square_sum(blue));
  const Pairs weight = as_pairs(set(W::kRed | W::kGreen << 16));
  return hn::Add(product_sum(red_green, multiply(red_green, weight)), square_sum(blue));
}

/// Weighted squared error of a half that takes the best code for each pixel.
template <class W>
HWY_NOINLINE V exact_error(const PixelPairs& pixels, bool flip, std::size_t half,
                           const Palette& palette) {
  V sum = set(0);
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t i = pixel_of(flip, half, k);
    const Pairs red_green = as_pairs(load(pixels.red_green[i]));
    const Pairs blue = as_pairs(load(pixels.blue[i]));
    V best =
        colour_error<W>(subtract(red_green, palette.red_green[0]), subtract(blue, palette.blue[0]));
    for (std::size_t code = 1; code < 4; ++code) {
      best = hn::Min(best, colour_error<W>(subtract(red_green, palette.red_green[code]),
                                           subtract(blue, palette.blue[code])));
    }
    sum = hn::Add(sum, best);
  }
  return sum;
}

/// The low word of a block, of one half's pixels: their codes at the places where GL reads them.
template <class W>
HWY_NOINLINE V half_codes(const PixelPairs& pixels, bool flip, std::size_t half,
                          const Palette& palette) {
  V word = set(0);
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t i = pixel_of(flip, half, k);
    const Pairs red_green = as_pairs(load(pixels.red_green[i]));
    const Pairs blue = as_pairs(load(pixels.blue[i]));
    V best = set(0x7fffffff);
    for (std::size_t code = 0; code < 4; ++code) {
      const V error = colour_error<W>(subtract(red_green, palette.red_green[code]),
                                      subtract(blue, palette.blue[code]));
      best = hn::Min(best, hn::Or(hn::ShiftLeft<2>(error), set(static_cast<std::int32_t>(code))));
    }
    const int bit = static_cast<int>(4 * (i % 4) + i / 4);
    const V low = hn::ShiftLeftSame(hn::And(best, set(1)), bit);
    const V high = hn::ShiftLeftSame(hn::And(hn::ShiftRight<1>(best), set(1)), bit + 16);
    word = hn::Or(word, hn::Or(low, high));
  }
  return word;
}

/// A choice for whole blocks: each lane its own.
struct Choice {
  Row error;
  Row colour[2];  ///< quantised, packed
  Row table[2];
  Row differential;  ///< 0 or 1
  Row flip;          ///< 0 or 1
};

/// One half of a block in one mode, with its error.
struct HalfFit {
  Row error;
  Row colour;
  Row table;
};

HWY_INLINE void keep_better(V error, const HalfFit (&fit)[2], bool differential, bool flip,
                            Choice& choice) {
  const M better = hn::Lt(error, load(choice.error));
  const auto keep = [&better](V value, Row& row)
                        HWY_ATTR { store(hn::IfThenElse(better, value, load(row)), row); };
  for (std::size_t half = 0; half < 2; ++half) {
    keep(load(fit[half].colour), choice.colour[half]);
    keep(load(fit[half].table), choice.table[half]);
  }
  keep(set(differential ? 1 : 0), choice.differential);
  keep(set(flip ? 1 : 0), choice.flip);
  keep(error, choice.error);
}

/// 8-bit value of a quantised channel whose mode differs from lane to lane.
HWY_INLINE V widen_either(V q, M differential) {
  return hn::IfThenElse(differential, widen<5>(q), widen<4>(q));
}

HWY_INLINE V high_word(const Choice& choice) {
  const M differential = hn::Eq(load(choice.differential), set(1));
  const V first = load(choice.colour[0]);
  const V second = load(choice.colour[1]);
  const V a[3] = {red_of(first), green_of(first), blue_of(first)};
  const V b[3] = {red_of(second), green_of(second), blue_of(second)};
  V word = set(0);
  for (std::size_t c = 0; c < 3; ++c) {
    const V step = hn::And(hn::Sub(b[c], a[c]), set(7));
    const V byte = hn::IfThenElse(differential, hn::Or(hn::ShiftLeft<3>(a[c]), step),
                                  hn::Or(hn::ShiftLeft<4>(a[c]), b[c]));
    word = hn::Or(hn::ShiftLeft<8>(word), byte);
  }
  const V tables =
      hn::Or(hn::ShiftLeft<5>(load(choice.table[0])), hn::ShiftLeft<2>(load(choice.table[1])));
  const V modes = hn::Or(hn::ShiftLeft<1>(load(choice.differential)), load(choice.flip));
  return hn::Or(hn::ShiftLeft<8>(word), hn::Or(tables, modes));
}

template <class W>
HWY_INLINE V low_word(const PixelPairs& pixels, const Choice& choice) {
  const M differential = hn::Eq(load(choice.differential), set(1));
  V upright = set(0);
  V flipped = set(0);
  for (std::size_t half = 0; half < 2; ++half) {
    const V colour = load(choice.colour[half]);
    Palette palette;
    make_palette(widen_either(red_of(colour), differential),
                 widen_either(green_of(colour), differential),
                 widen_either(blue_of(colour), differential), load(choice.table[half]), palette);
    upright = hn::Or(upright, half_codes<W>(pixels, false, half, palette));
    flipped = hn::Or(flipped, half_codes<W>(pixels, true, half, palette));
  }
  return hn::IfThenElse(hn::Eq(load(choice.flip), set(1)), flipped, upright);
}

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

/// Differential mode: the colour must be from `below` to `above` the other half's.
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

/// Steps of one value in the channels of a packed colour. A channel that overflows changes the
/// next; within() rejects it.
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
