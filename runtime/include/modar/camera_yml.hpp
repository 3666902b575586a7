// Camera files without OpenCV, and what a camera must be.
#pragma once

#include <string>

#include "formats/base/error.hpp"
#include "modar/camera.hpp"

namespace modar {

/// Errors: kInvalidInput "camera.size", "camera.matrix", "camera.distortion" where a size or focal
/// length is not positive or a number is not finite.
Result<void> validate(const Camera& camera);

/// Reads the YAML that `modar calibrate` (OpenCV's FileStorage) writes; a size of 0 if it states
/// none. Errors: kIo "camera.open", kInvalidInput "camera.*", kUnsupported "camera.distortion"
/// beyond five coefficients.
Result<Camera> read_camera_yml(const std::string& path);

}  // namespace modar
