// Many ETC1 blocks at once: the one encoder, compiled for every SIMD level of the processor family.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace modar {

/// How hard the encoder looks for good blocks.
struct Etc1Search {
  /// How far from a half's mean colour its base colours are tried, along the gray axis: `reach`
  /// units of 1/8 of a value, plus `spread` 1/8 of the half's greatest difference of brightness.
  int reach5 = 0;
  int spread5 = 0;
  int reach4 = 0;
  int spread4 = 0;
  bool perceptual = false;  ///< errors weighted like luma (3:6:1), not equally
  bool exact = false;       ///< compare modes and flips by true errors, not by estimates
  bool thorough = false;    ///< refine the best colour of every table, not of the best one alone
  int rounds = 0;           ///< of steps around the best colours, by true errors
};

/// As many blocks as one call takes; a multiple of the lanes of any vector.
inline constexpr std::size_t kEtc1Batch = 32;

/// Blocks side by side: pixel 4 * y + x of block b is pixels[4 * y + x][b], red in the lowest byte,
/// then green, blue; the highest byte is 0.
struct Etc1BatchIn {
  alignas(64) std::uint32_t pixels[16][kEtc1Batch];
};
/// The halves of each block's 64 bits.
struct Etc1BatchOut {
  alignas(64) std::uint32_t high[kEtc1Batch];
  alignas(64) std::uint32_t low[kEtc1Batch];
};

/// Encodes a whole batch. The bits do not depend on the SIMD level: all arithmetic is on integers,
/// and no block sees its neighbours.
void encode_etc1_batch(const Etc1BatchIn& in, const Etc1Search& search, Etc1BatchOut& out);

/// SIMD levels that this machine can run, best first, as bits of Highway's targets.
std::vector<std::int64_t> simd_levels();
std::string simd_level_name(std::int64_t level);
/// For tests: Highway's switch, which makes every kernel of this process (the pattern's too) run
/// with this level only; 0: the best again.
void force_simd_level(std::int64_t level);

}  // namespace modar
