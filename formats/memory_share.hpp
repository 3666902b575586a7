// How a budget of GPU memory is divided: the renderer keeps to it, and the checker judges by it.
#pragma once

#include <algorithm>
#include <cstdint>

#include "formats/bundle_view.hpp"
#include "formats/texture_format.hpp"

namespace modar {

/// Bytes of a texture with all its levels on a device: decoded to RGB where the device does not
/// read its blocks.
inline std::uint64_t texture_bytes(const BundleView& bundle, std::uint32_t texture, bool reads) {
  const std::uint64_t bytes = bundle.texture_data(texture).size();
  const TextureFormatInfo& format = *find_texture_format(bundle.textures()[texture].format);
  return reads ? bytes : bytes / format.block_bytes * format.block_side * format.block_side * 3;
}

/// Bytes of the budget that geometry may take: half, and what all textures leave of the other half.
/// textures: their bytes on the device. A budget of 0 means no limit.
inline std::uint64_t geometry_share(std::uint64_t textures, std::uint64_t budget) {
  return budget - std::min(budget / 2, textures);
}

}  // namespace modar
