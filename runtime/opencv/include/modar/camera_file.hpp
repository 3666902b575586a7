// The camera's interior orientation from a calibration file.
#pragma once

#include <string>

#include "formats/base/error.hpp"
#include "modar/camera.hpp"

namespace modar {

/// Reads an OpenCV YML, XML or JSON with camera_matrix and distortion_coefficients (or
/// cameraMatrix, distCoeffs, or K, D) and the image size (image_width and image_height, or
/// image_size). Without a size, width and height are 0: the camera fits whatever frames come.
/// Errors: kIo "camera.open", kInvalidInput "camera.*", kUnsupported "camera.distortion" (a model
/// with more than k1 k2 p1 p2 k3) or "camera.unsupported" (a build without OpenCV).
Result<Camera> read_camera_file(const std::string& path);

}  // namespace modar
