// The loop that a pattern's record takes most of its time in, compiled for each SIMD level, as is
// code_distances(). All sums are of integers, so that every level gives the same bytes. Internal to
// runtime/record.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace modar {

/// What the pixels of a view are sampled from.
struct ViewSamples {
  /// A word a pixel of the level, row by row: the pixel, its right neighbour, the one below and
  /// that one's right neighbour, from the lowest byte on. In the last column and row nothing is
  /// read.
  const std::uint32_t* quads = nullptr;
  int width = 0;
  int height = 0;
  /// Places of a pixel's samples around its centre: at most 36, in pixels of the level, 16 bits
  /// after the point.
  std::span<const std::array<std::int32_t, 2>> offsets;
};

/// The means of the samples of `count` pixels, bilinear, the level's border repeated around it.
/// x, y: centres in pixels of the level, 16 bits after the point. out: `count` grays.
void sample_pixels(const ViewSamples& samples, const std::int32_t* x, const std::int32_t* y,
                   std::size_t count, std::uint8_t* out);

/// Both loops as one SIMD level has them.
struct ViewLoops {
  void (*sample)(const ViewSamples& samples, const std::int32_t* x, const std::int32_t* y,
                 std::size_t count, std::uint8_t* out);
  void (*distances)(const std::array<std::uint8_t, 32>& code,
                    const std::array<std::uint8_t, 32>* codes, const std::uint32_t* which,
                    std::size_t count, int* out);
};

}  // namespace modar
