// ETC1 blocks to RGB pixels, for contexts that cannot read ETC1.
// Source: GL_OES_compressed_ETC1_RGB8_texture, the extension's text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace modar {

/// blocks: 8 bytes a 4x4 block, in rows of ceil(width/4). rgb: 3 bytes a pixel, top row first,
/// width * height * 3 bytes without padding. blocks.size() is at least what the size asks for.
void decode_etc1_rgb(std::span<const std::byte> blocks, std::uint32_t width, std::uint32_t height,
                     std::span<std::uint8_t> rgb);

}  // namespace modar
