// Compressed textures as files of other tools.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/layout.hpp"

namespace modar {

/// PKM 1.0 around ETC1 blocks (as Android's etc1tool reads it): 16-byte header, then the blocks.
std::vector<std::byte> to_pkm(std::span<const std::byte> blocks, std::uint32_t width,
                              std::uint32_t height);

/// One level's blocks of a KTX 1 file.
struct KtxLevel {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::span<const std::byte> blocks;
};
/// KTX 1 with blocks of the format, all levels.
std::vector<std::byte> to_ktx(TextureFormat format, std::span<const KtxLevel> levels);

}  // namespace modar
