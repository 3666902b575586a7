// An image to ETC1 blocks: blocks of one colour by tables, all others in batches through the
// kernel.
#include "bake/texture/etc1/etc1_encoder.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "bake/texture/etc1/etc1_kernel.hpp"
#include "formats/base/parallel.hpp"

namespace modar {
namespace {

/// Blocks that a thread sorts by contrast at a time. More make more equal batches, fewer spread
/// small images over more threads. tuned: etc1
constexpr std::size_t kTile = 512;

using Pixels16 = std::array<std::uint32_t, 16>;

/// What each effort means to the kernel: how far from the mean colour it looks (reach, spread), and
/// how often it steps on (rounds). Chosen with `modar-lab bench etc1`; on four Kodak photos
/// (512x512 crops) the efforts reach 36.19, 36.63 and 36.78 dB at 57, 14 and 1.2 Mpixel/s,
/// libetc1 34.92 dB at 2.5.
Etc1Search search_of(const EncodeOptions& options) {
  Etc1Search search;
  search.perceptual = options.perceptual;
  switch (options.effort) {
    case TextureEffort::kFast:
      search.reach5 = 32;
      search.reach4 = 64;
      break;
    case TextureEffort::kGood:
      search.reach5 = 24;
      search.reach4 = 32;
      search.spread5 = search.spread4 = 1;
      search.exact = true;
      search.rounds = 2;
      break;
    case TextureEffort::kBest:
      search.reach5 = search.reach4 = 2040;  // the whole path
      search.exact = search.thorough = true;
      search.rounds = 4;
      break;
  }
  return search;
}

std::uint32_t rgb_of(const std::uint8_t* pixel) {
  return std::uint32_t{pixel[0]} | std::uint32_t{pixel[1]} << 8 | std::uint32_t{pixel[2]} << 16;
}

Pixels16 gather(const RgbaImage& image, std::size_t left, std::size_t top) {
  Pixels16 pixels;
  if (left + 4 <= image.width && top + 4 <= image.height) {
    for (std::size_t y = 0; y < 4; ++y) {
      const std::uint8_t* row = &image.pixels[((top + y) * image.width + left) * 4];
      for (std::size_t x = 0; x < 4; ++x) pixels[4 * y + x] = rgb_of(row + 4 * x);
    }
    return pixels;
  }
  for (std::size_t i = 0; i < 16; ++i) {
    const std::size_t x = std::min<std::size_t>(left + i % 4, image.width - 1);
    const std::size_t y = std::min<std::size_t>(top + i / 4, image.height - 1);
    pixels[i] = rgb_of(&image.pixels[(y * image.width + x) * 4]);
  }
  return pixels;
}

/// Difference between the brightest and the darkest pixel, 0-765.
std::uint32_t contrast(const Pixels16& pixels) {
  std::array<std::int16_t, 16> sums;
  for (std::size_t i = 0; i < 16; ++i) {
    sums[i] =
        static_cast<std::int16_t>((pixels[i] & 255) + (pixels[i] >> 8 & 255) + (pixels[i] >> 16));
  }
  std::int16_t low = sums[0];
  std::int16_t high = sums[0];
  for (const std::int16_t sum : sums) {
    low = std::min(low, sum);
    high = std::max(high, sum);
  }
  return static_cast<std::uint32_t>(high - low);
}

void write_block(std::uint64_t word, std::byte* out) {
  for (std::size_t i = 0; i < 8; ++i) out[i] = static_cast<std::byte>(word >> (56 - 8 * i) & 0xff);
}

constexpr std::size_t kModifiers = 32;  // table * 4 + code

/// For a mode (0: 4 bits, 1: 5 bits), a modifier and a value: the best base and how far it is off.
struct SolidTable {
  std::uint8_t base[2][kModifiers][256]{};
  std::uint8_t miss[2][kModifiers][256]{};

  SolidTable() {
    for (std::size_t mode = 0; mode < 2; ++mode) {
      for (std::size_t modifier = 0; modifier < kModifiers; ++modifier) fill(mode, modifier);
    }
  }

 private:
  void fill(std::size_t mode, std::size_t modifier) {
    const int size = kEtc1Modifiers[modifier / 4][modifier % 2];
    const int add = modifier % 4 >= 2 ? -size : size;
    for (int value = 0; value < 256; ++value) {
      int best = 256;
      int best_base = 0;
      for (int q = 0; q < (mode == 1 ? 32 : 16); ++q) {
        const int wide = mode == 1 ? etc1_expand5(q) : etc1_expand4(q);
        const int off = std::abs(std::clamp(wide + add, 0, 255) - value);
        if (off < best) {
          best = off;
          best_base = q;
        }
      }
      const auto at = static_cast<std::size_t>(value);
      base[mode][modifier][at] = static_cast<std::uint8_t>(best_base);
      miss[mode][modifier][at] = static_cast<std::uint8_t>(best);
    }
  }
};

const SolidTable& solid_table() {
  static const SolidTable table;
  return table;
}

/// All pixels of one code in the low word.
constexpr std::uint64_t codes_of(std::size_t code) {
  return (code >= 2 ? std::uint64_t{0xffff0000} : 0) | (code % 2 == 1 ? 0xffff : 0);
}

/// The best block for sixteen pixels of one colour (red in the lowest byte, then green, blue), as
/// the number whose most significant byte GL reads first. It needs no search: for each modifier
/// the nearest base colour is known. perceptual: weights 3:6:1, else equal ones.
std::uint64_t encode_solid(std::uint32_t rgb, bool perceptual) {
  const SolidTable& table = solid_table();
  const std::size_t value[3] = {rgb & 255, rgb >> 8 & 255, rgb >> 16 & 255};
  const std::uint32_t weight[3] = {perceptual ? 3U : 1U, perceptual ? 6U : 1U, 1U};
  std::uint32_t best = ~0U;
  std::size_t best_mode = 0;
  std::size_t best_modifier = 0;
  for (std::size_t mode = 0; mode < 2; ++mode) {
    for (std::size_t modifier = 0; modifier < kModifiers; ++modifier) {
      std::uint32_t error = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint32_t miss = table.miss[mode][modifier][value[c]];
        error += weight[c] * miss * miss;
      }
      if (error >= best) continue;
      best = error;
      best_mode = mode;
      best_modifier = modifier;
    }
  }
  std::uint64_t high = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::uint64_t base = table.base[best_mode][best_modifier][value[c]];
    high = high << 8 | (best_mode == 1 ? base << 3 : base << 4 | base);
  }
  const std::uint64_t tables = best_modifier / 4 * 9;  // the same table in both halves
  high = high << 8 | tables << 2 | best_mode << 1;
  return high << 32 | codes_of(best_modifier % 4);
}

/// The blocks of a tile that wait for the kernel.
class Tile {
 public:
  Tile(const Etc1Search& search, std::byte* out) : search_(search), out_(out) {}

  void add(std::size_t index, const Pixels16& pixels) {
    const bool solid = std::all_of(pixels.begin(), pixels.end(),
                                   [&pixels](std::uint32_t p) { return p == pixels[0]; });
    if (solid) {
      write_block(encode_solid(pixels[0], search_.perceptual), out_ + 8 * index);
      return;
    }
    // A walk is as long as the contrast asks, and a vector waits for its longest: like goes to
    // like.
    const std::uint32_t key = search_.spread5 + search_.spread4 > 0 ? contrast(pixels) : 0;
    order_[count_++] = key << 16 | static_cast<std::uint32_t>(index);
    pixels_[index] = pixels;
  }

  void encode() {
    std::sort(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(count_));
    for (std::size_t first = 0; first < count_; first += kEtc1Batch) encode_batch(first);
  }

 private:
  /// The last batch is filled up with its last block.
  void encode_batch(std::size_t first) {
    const auto index_of = [&](std::size_t i) {
      return std::size_t{order_[std::min(first + i, count_ - 1)] & 0xffff};
    };
    Etc1BatchIn in;
    for (std::size_t i = 0; i < kEtc1Batch; ++i) {
      const Pixels16& pixels = pixels_[index_of(i)];
      for (std::size_t pixel = 0; pixel < 16; ++pixel) in.pixels[pixel][i] = pixels[pixel];
    }
    Etc1BatchOut batch;
    encode_etc1_batch(in, search_, batch);
    for (std::size_t i = 0; i < kEtc1Batch && first + i < count_; ++i) {
      write_block(std::uint64_t{batch.high[i]} << 32 | batch.low[i], out_ + 8 * index_of(i));
    }
  }

  const Etc1Search& search_;
  std::byte* out_;
  std::size_t count_ = 0;
  std::array<std::uint32_t, kTile> order_;
  std::array<Pixels16, kTile> pixels_;
};

}  // namespace

std::vector<std::byte> encode_etc1(const RgbaImage& image, const EncodeOptions& options) {
  const std::size_t columns = (std::size_t{image.width} + 3) / 4;
  const std::size_t count = columns * ((std::size_t{image.height} + 3) / 4);
  std::vector<std::byte> blocks(count * 8);
  const Etc1Search search = search_of(options);
  const auto tiles = static_cast<std::uint32_t>((count + kTile - 1) / kTile);
  parallel_rows(tiles, options.jobs, [&](std::uint32_t number) {
    const std::size_t first = number * kTile;
    Tile tile(search, &blocks[first * 8]);
    for (std::size_t i = 0; i < kTile && first + i < count; ++i) {
      const std::size_t block = first + i;
      tile.add(i, gather(image, block % columns * 4, block / columns * 4));
    }
    tile.encode();
  });
  return blocks;
}

}  // namespace modar
