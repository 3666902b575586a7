// Android's libetc1 as the peer of the benchmark, where the build has found it.
#pragma once

#include <cstddef>
#include <vector>

#include "bake/image/image.hpp"

namespace modar {

/// Whether encode_etc1_reference() encodes; else it answers nothing.
extern const bool kHasEtc1Reference;

/// ETC1 blocks as libetc1 makes them; sides are multiples of 4.
std::vector<std::byte> encode_etc1_reference(const RgbaImage& image);

}  // namespace modar
