// One picture into one file, in the format that the build has.
#pragma once

#include <string>

#include "formats/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Writes path.png on a desk, path.ppm on the device, through AtomicFile. Errors: kIo.
Result<void> write_frame_picture(const std::string& path, const RgbImage& image);

}  // namespace modar
