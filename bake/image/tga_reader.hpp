// Truevision TGA, which OpenCV does not read.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "bake/image/image.hpp"

namespace modar {

/// Colour-mapped, true-colour and gray images, plain or run-length encoded, of 8 to 32 bits, from
/// either side. The header has passed read_image_header(). Errors: kInvalidInput "image.decode".
Result<RgbaImage> read_tga(std::span<const std::byte> bytes, const std::string& name);

}  // namespace modar
