// Android's libetc1 as an independent eye on ETC1 blocks.
#pragma once

#include "bake/texture/texture.hpp"

namespace modar::test {

/// Android's decoding of blocks; sides are multiples of 4.
RgbaImage libetc1_decode(std::span<const std::byte> blocks, std::uint32_t width,
                         std::uint32_t height);
/// Android's encoding of an image; sides are multiples of 4.
std::vector<std::byte> libetc1_encode(const RgbaImage& image);

}  // namespace modar::test
