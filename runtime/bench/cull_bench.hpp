// How many triangles culling sends, against those whose own boxes meet the frustum.
#pragma once

#include <cstdint>

#include "formats/bundle_view.hpp"

namespace modar {

/// Summed over views from the model's middle in the six directions of the axes and the eight
/// between.
struct CullCounts {
  std::uint64_t sent = 0;    ///< triangles of the level-0 chunks that frustum culling leaves
  std::uint64_t needed = 0;  ///< triangles whose own box meets the same frustum
};

/// Reads every vertex position of level 0 from the bytes.
CullCounts count_culling(const BundleView& bundle, std::uint32_t model);

}  // namespace modar
