// Pixels to ETC1 blocks: both modes, both flips, all tables, base colours refined per table.
#include <algorithm>
#include <limits>

#include "bake/texture/etc1_block.hpp"
#include "bake/texture/etc1_texture.hpp"
#include "bake/texture/parallel.hpp"

namespace modar {
namespace {

constexpr int kMaxError = std::numeric_limits<int>::max();
constexpr int kRefinements = 4;

using Colour = std::array<int, 3>;
using Half = std::array<Colour, 8>;

/// One half of a block with a base colour of 4 or 5 bits.
struct HalfFit {
  int error = kMaxError;
  Colour base{};
  int table = 0;
  std::array<std::uint8_t, 8> code{};
};

/// The bounds that a half's base colour must keep, inclusive.
struct Bounds {
  Colour low{};
  Colour high{};
};

int expand(int value, bool five) {
  return five ? etc1_expand5(value) : etc1_expand4(value);
}

/// Nearest quantised value of a channel, given as a sum of eight 8-bit values.
int quantise(int sum, bool five, int low, int high) {
  const int top = five ? 31 : 15;
  const int guess = std::clamp((sum * top + 1020) / 2040, low, high);
  int best = guess;
  int best_distance = kMaxError;
  for (int value = std::max(low, guess - 1); value <= std::min(high, guess + 1); ++value) {
    const int distance = std::abs(8 * expand(value, five) - sum);
    if (distance < best_distance) {
      best_distance = distance;
      best = value;
    }
  }
  return best;
}

/// The best codes of a base colour under one table.
HalfFit assign(const Half& pixels, const Colour& base, int table, bool five) {
  HalfFit fit{0, base, table, {}};
  const Colour wide = {expand(base[0], five), expand(base[1], five), expand(base[2], five)};
  std::array<Colour, 4> palette;
  for (int code = 0; code < 4; ++code) {
    const int add = etc1_modifier(table, code);
    for (std::size_t c = 0; c < 3; ++c) {
      palette[static_cast<std::size_t>(code)][c] = std::clamp(wide[c] + add, 0, 255);
    }
  }
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    int best = kMaxError;
    for (std::size_t code = 0; code < 4; ++code) {
      int error = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const int d = pixels[i][c] - palette[code][c];
        error += d * d;
      }
      if (error < best) {
        best = error;
        fit.code[i] = static_cast<std::uint8_t>(code);
      }
    }
    fit.error += best;
  }
  return fit;
}

/// The base colour that the codes of a fit ask for: the mean of what is left of the pixels.
Colour refined_base(const Half& pixels, const HalfFit& fit, bool five, const Bounds& bounds) {
  int modifiers = 0;
  for (const std::uint8_t code : fit.code) modifiers += etc1_modifier(fit.table, code);
  Colour base{};
  for (std::size_t c = 0; c < 3; ++c) {
    int sum = -modifiers;
    for (const Colour& pixel : pixels) sum += pixel[c];
    base[c] = quantise(std::clamp(sum, 0, 2040), five, bounds.low[c], bounds.high[c]);
  }
  return base;
}

HalfFit fit_half(const Half& pixels, bool five, const Bounds& bounds) {
  Colour mean{};
  for (std::size_t c = 0; c < 3; ++c) {
    int sum = 0;
    for (const Colour& pixel : pixels) sum += pixel[c];
    mean[c] = quantise(sum, five, bounds.low[c], bounds.high[c]);
  }
  HalfFit best;
  for (int table = 0; table < 8; ++table) {
    Colour base = mean;
    for (int round = 0; round < kRefinements; ++round) {
      const HalfFit fit = assign(pixels, base, table, five);
      if (fit.error < best.error) best = fit;
      const Colour next = refined_base(pixels, fit, five, bounds);
      if (next == base) break;
      base = next;
    }
  }
  return best;
}

Bounds all_colours(bool five) {
  const int top = five ? 31 : 15;
  return {{0, 0, 0}, {top, top, top}};
}

/// Bounds of one half of a differential block, given the other half's colour.
Bounds around(const Colour& other, int low, int high) {
  Bounds bounds;
  for (std::size_t c = 0; c < 3; ++c) {
    bounds.low[c] = std::max(0, other[c] + low);
    bounds.high[c] = std::min(31, other[c] + high);
  }
  return bounds;
}

bool within(const Colour& colour, const Bounds& bounds) {
  for (std::size_t c = 0; c < 3; ++c) {
    if (colour[c] < bounds.low[c] || colour[c] > bounds.high[c]) return false;
  }
  return true;
}

/// Fits both halves to differential mode: each alone where that is legal, else the better of
/// keeping the one and bounding the other.
std::array<HalfFit, 2> fit_differential(const std::array<Half, 2>& halves) {
  const HalfFit first = fit_half(halves[0], true, all_colours(true));
  const HalfFit second = fit_half(halves[1], true, all_colours(true));
  if (within(second.base, around(first.base, -4, 3))) return {first, second};
  const HalfFit bounded_second = fit_half(halves[1], true, around(first.base, -4, 3));
  const HalfFit bounded_first = fit_half(halves[0], true, around(second.base, -3, 4));
  if (first.error + bounded_second.error <= bounded_first.error + second.error) {
    return {first, bounded_second};
  }
  return {bounded_first, second};
}

using BlockPixels = std::array<Colour, 16>;

Etc1Block encode_block(const BlockPixels& pixels) {
  Etc1Block best;
  int best_error = kMaxError;
  for (const bool flip : {false, true}) {
    std::array<Half, 2> halves{};
    std::array<std::size_t, 2> filled{};
    for (std::size_t i = 0; i < 16; ++i) {
      const std::size_t half = etc1_half(flip, i % 4, i / 4);
      halves[half][filled[half]++] = pixels[i];
    }
    for (const bool differential : {true, false}) {
      const std::array<HalfFit, 2> fits =
          differential ? fit_differential(halves)
                       : std::array<HalfFit, 2>{fit_half(halves[0], false, all_colours(false)),
                                                fit_half(halves[1], false, all_colours(false))};
      const int error = fits[0].error + fits[1].error;
      if (error >= best_error) continue;
      best_error = error;
      best.flip = flip;
      best.differential = differential;
      best.base = {fits[0].base, fits[1].base};
      best.table = {fits[0].table, fits[1].table};
      filled = {0, 0};
      for (std::size_t i = 0; i < 16; ++i) {
        const std::size_t half = etc1_half(flip, i % 4, i / 4);
        best.code[i] = fits[half].code[filled[half]++];
      }
    }
  }
  return best;
}

BlockPixels gather(const RgbaImage& image, std::size_t left, std::size_t top) {
  BlockPixels pixels{};
  for (std::size_t i = 0; i < 16; ++i) {
    const std::size_t x = std::min<std::size_t>(left + i % 4, image.width - 1);
    const std::size_t y = std::min<std::size_t>(top + i / 4, image.height - 1);
    const std::uint8_t* in = &image.pixels[(y * image.width + x) * 4];
    pixels[i] = {in[0], in[1], in[2]};
  }
  return pixels;
}

}  // namespace

std::vector<std::byte> encode_etc1(const RgbaImage& image, unsigned jobs) {
  const std::uint32_t columns = (image.width + 3) / 4;
  const std::uint32_t rows = (image.height + 3) / 4;
  std::vector<std::byte> blocks(std::size_t{columns} * rows * 8);
  parallel_rows(rows, jobs, [&](std::uint32_t row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const Etc1Block block = encode_block(gather(image, column * 4UL, row * 4UL));
      pack_etc1(block,
                std::span(blocks).subspan((std::size_t{row} * columns + column) * 8).first<8>());
    }
  });
  return blocks;
}

}  // namespace modar
