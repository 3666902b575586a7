// Picture files on a desk, without OpenCV's types.
#pragma once

#include <string>

#include "frame_sink.hpp"

namespace modar {

/// Writes a PNG (the alpha is left out) through AtomicFile. Errors: kIo "out.write", "io.*".
Result<void> write_png(const std::string& path, const RgbaImage& image);

}  // namespace modar
