// The loops over pixels and bits that take most of a frame's time, one table per SIMD level. All
// levels give the same bits: the loops use integers, or floats that are summed in an order that
// does not depend on the number of lanes. Internal to runtime/track.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace modar::tracker {

inline constexpr int kSlack = 64;       ///< elements past a range that kernels may read or write
inline constexpr int kBlockCodes = 32;  ///< codes in a block; byte k of all of them is contiguous
inline constexpr int kCodeBytes = 32;   ///< 256 bits

/// Half side of a tracking patch, pixels. Smaller patches match in more places, larger ones cross
/// more occluders' edges. Records depend on it.
inline constexpr int kPatchHalf = 4;
inline constexpr int kPatchSide = 2 * kPatchHalf + 1;
inline constexpr int kPatchPixels = 84;  ///< those 81, padded to whole vectors

/// A pattern's patch for alignment: gray values and half differences to the right and down, row by
/// row; the padding is zero. The gradient is the template's, which has no noise: noise in both the
/// gradient and the difference would bias displacements towards half pixels.
struct PatchTemplate {
  alignas(16) float gray[kPatchPixels];
  alignas(16) float right[kPatchPixels];
  alignas(16) float down[kPatchPixels];
};

/// Offsets of a patch's pixels from its centre, row by row; the padding's are zero.
struct PatchOffsets {
  alignas(16) float right[kPatchPixels] = {};
  alignas(16) float down[kPatchPixels] = {};
  constexpr PatchOffsets() {
    for (int k = 0; k < kPatchSide * kPatchSide; ++k) {
      right[k] = static_cast<float>(k % kPatchSide - kPatchHalf);
      down[k] = static_cast<float>(k / kPatchSide - kPatchHalf);
    }
  }
};

inline constexpr PatchOffsets kPatchOffsets;

/// A patch in an image: its centre, and the image steps of one template pixel.
struct PatchPlace {
  float x = 0, y = 0;
  float right_x = 1, right_y = 0;
  float down_x = 0, down_y = 1;
};

/// Sums over a patch: of the image, its square, and its products with the template's three.
struct PatchSums {
  float i = 0, ii = 0, ti = 0, ix = 0, iy = 0;
};

struct Kernels {
  const char* name;
  /// out[i] = mean of the 2x2 pixels at 2 * i, rounded. Reads 2 * count pixels of both rows, no
  /// more.
  void (*halve_row)(const std::uint8_t* top, const std::uint8_t* bottom, std::uint8_t* out,
                    int count);
  /// Vertical binomial 1 4 6 4 1 of five rows; reads and writes `count` elements, no more.
  void (*blur_columns)(const std::uint8_t* const* rows, std::uint16_t* out, int count);
  /// Horizontal binomial of that, back to pixels: out[i] from in[i-2] to in[i+2].
  /// in[-2] to in[count + kSlack] are readable, out to count + kSlack writable.
  void (*blur_row)(const std::uint16_t* in, std::uint8_t* out, int count);
  /// FAST-9 scores of `count` pixels from `pixels` on: the greatest threshold at which the pixel is
  /// still a corner, 0 where that is below `threshold`. bright[i] is the score of brighter arcs
  /// alone. Rows three above to three below, and kSlack past the range, are readable.
  void (*corner_scores)(const std::uint8_t* pixels, std::ptrdiff_t stride, int threshold, int count,
                        std::uint8_t* bright, std::uint8_t* score);
  /// peak[i] = row[i] where that is a maximum of its 3x3 neighbours (of equal ones the first), else
  /// 0.
  void (*peaks)(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below,
                int count, std::uint8_t* peak);
  /// Hamming distances (at most 255) of a code to blocks of kBlockCodes; returns the smallest.
  /// Blocks none of whose codes is within `limit` over their first 16 bytes get 255
  /// throughout.
  int (*distances)(const std::uint8_t* code, const std::uint8_t* blocks, std::size_t block_count,
                   int limit, std::uint8_t* out);
  /// Samples the image bilinearly under a patch that is inside with a pixel to spare. Its sums
  /// are added in the same order at every level: four partial ones, each of every fourth pixel.
  PatchSums (*patch_sums)(const PatchTemplate& patch, const PatchPlace& place,
                          const std::uint8_t* pixels, std::ptrdiff_t stride);
};

/// A level that this processor supports: an index into all_kernels(), clamped; -1: the best.
const Kernels& kernels(int level = -1);
/// Every level that this processor supports, best last.
std::span<const Kernels> all_kernels();

}  // namespace modar::tracker
