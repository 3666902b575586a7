// The shape of a flat, rectangular object from one photo of it.
#pragma once

#include <array>
#include <cstdint>

namespace modar {

struct PixelPoint {
  double x = 0;
  double y = 0;
};

struct AspectEstimate {
  double aspect = 0;  ///< width over height
  double spread = 0;  ///< its standard deviation
};

/// Whether a photo has a shape that cameras make; otherwise it is cropped.
bool has_camera_shape(double width, double height);

/// Width over height of the rectangle whose corners (top-left, top-right, bottom-right,
/// bottom-left) are there in a photo of that size, and how far that may be off. Each focal length
/// gives an aspect and says how right the angle at the corners is then (Zhang & He, "Whiteboard
/// scanning and image enhancement", 2007, Eq. 11 to 20); all are weighed by that angle, given that
/// corners and principal point are known to some pixels only, and by what photos usually have.
/// focal_px: by the photo's EXIF; 0: not known. Of a cropped photo the principal point is not,
/// either.
AspectEstimate estimate_aspect(const std::array<PixelPoint, 4>& corners, std::uint32_t width,
                               std::uint32_t height, double focal_px);

}  // namespace modar
