// A gyroscope's record next to a video: how the camera turned from frame to frame.
#pragma once

#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "formats/base/error.hpp"

namespace modar {

/// A line a frame, of three decimal numbers: the rotation vector in radians, in the camera's axes
/// (x right, y down, z forward), from the frame before; '#' starts a comment. Errors: those of
/// MappedFile::open(); kInvalidInput "gyro.line" with file and line.
Result<std::vector<glm::dvec3>> read_gyroscope(const std::string& path);

}  // namespace modar
