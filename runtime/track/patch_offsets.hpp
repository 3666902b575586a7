// A table of the kernels that all SIMD levels share.
#pragma once

#include "kernels.hpp"

namespace modar::tracker {

/// Where a patch's pixels lie around its centre, row by row; the filling lies on it.
struct PatchOffsets {
  alignas(16) float right[kPatchPixels] = {};
  alignas(16) float down[kPatchPixels] = {};
  constexpr PatchOffsets() {
    constexpr int kSide = 2 * kPatchHalf + 1;
    for (int k = 0; k < kSide * kSide; ++k) {
      right[k] = static_cast<float>(k % kSide - kPatchHalf);
      down[k] = static_cast<float>(k / kSide - kPatchHalf);
    }
  }
};

inline constexpr PatchOffsets kPatchOffsets;

}  // namespace modar::tracker
