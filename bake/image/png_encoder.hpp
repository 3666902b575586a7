// Pixels to PNG bytes, for the images inside GLB files.
#pragma once

#include <string>

#include "bake/image/image.hpp"

namespace modar {

/// An 8-bit RGB file, or RGBA where any pixel is not opaque. Empty where the image is.
std::string encode_png(const RgbaImage& image);

}  // namespace modar
