// An image to ETC1 blocks: cuts it into tiles, sorts their blocks into batches, hands them to the
// kernel.
#include <algorithm>
#include <array>

#include "bake/parallel.hpp"
#include "bake/texture/etc1/etc1_kernel.hpp"
#include "bake/texture/etc1/etc1_solid.hpp"
#include "bake/texture/texture.hpp"

namespace modar {
namespace {

/// Blocks that one thread takes at a time, and that are sorted among themselves.
constexpr std::size_t kTile = 512;

using Pixels16 = std::array<std::uint32_t, 16>;

/// What each effort means to the kernel.
Etc1Search search_of(const Etc1Options& options) {
  Etc1Search search;
  search.perceptual = options.perceptual;
  switch (options.effort) {
    case Etc1Effort::kFast:
      search.reach5 = 32;
      search.reach4 = 64;
      break;
    case Etc1Effort::kGood:
      search.reach5 = 24;
      search.reach4 = 32;
      search.spread5 = search.spread4 = 1;
      search.exact = true;
      search.rounds = 2;
      break;
    case Etc1Effort::kBest:
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

/// The blocks of a tile that wait for the kernel.
class Tile {
 public:
  Tile(const Etc1Search& search, std::byte* out) : search_(search), out_(out) {}

  void add(std::size_t index, const Pixels16& pixels) {
    const bool solid = std::all_of(pixels.begin(), pixels.end(),
                                   [&pixels](std::uint32_t p) { return p == pixels[0]; });
    if (solid) {
      write_block(encode_solid_etc1(pixels[0], search_.perceptual), out_ + 8 * index);
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

std::vector<std::byte> encode_etc1(const RgbaImage& image, const Etc1Options& options) {
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
