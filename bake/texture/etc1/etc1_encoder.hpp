// ETC1's encoder. Others reach it through bake/texture/texture_codec.hpp; benches and tests name
// it.
#pragma once

#include <cstddef>
#include <vector>

#include "bake/texture/texture_codec.hpp"

namespace modar {

/// See TextureCodec::encode: ceil(w/4) * ceil(h/4) blocks of 8 bytes.
std::vector<std::byte> encode_etc1(const RgbaImage& image, const EncodeOptions& options = {});

}  // namespace modar
