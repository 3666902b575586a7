// How a budget of GPU memory is divided: the renderer keeps to it, and the checker judges by it.
#pragma once

#include <algorithm>
#include <cstdint>

#include "formats/bundle_view.hpp"

namespace modar {

inline std::uint64_t texture_bytes(const BundleView& bundle) {
  std::uint64_t bytes = 0;
  for (std::uint32_t i = 0; i < bundle.textures().size(); ++i) {
    bytes += bundle.texture_data(i).size();
  }
  return bytes;
}

/// Bytes of the budget that geometry may take: half, and what all textures leave of the other half.
/// 0 stands for no limit.
inline std::uint64_t geometry_share(const BundleView& bundle, std::uint64_t budget) {
  return budget - std::min(budget / 2, texture_bytes(bundle));
}

}  // namespace modar
