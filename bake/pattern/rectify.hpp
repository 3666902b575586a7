// `modar pattern rectify`: from a photo of a flat object to its frontal picture.
#pragma once

#include <array>
#include <cstdint>

#include "bake/image/image.hpp"
#include "bake/pattern/plane_aspect.hpp"
#include "formats/base/error.hpp"

namespace modar {

struct RectifyOptions {
  /// In the photo: top-left, top-right, bottom-right, bottom-left of the pattern.
  std::array<PixelPoint, 4> corners{};
  double width_mm = 0;   ///< physical width, 0: unknown
  double height_mm = 0;  ///< physical height; 0: estimated from the perspective
  double focal_px = 0;   ///< of the photo, by its EXIF block; 0: not known
  std::uint32_t max_side =
      720;  ///< pixels of the longer side of the result, never more than the photo has
  [[nodiscard]] Result<void> validate() const;
};

struct Rectified {
  RgbaImage image;
  AspectEstimate aspect;  ///< that the image was made with; spread 0 where both sizes are known
  AspectEstimate seen;    ///< by the perspective alone
};

/// A frontal view of the quadrilateral. Its aspect ratio is that of the sizes in mm where both are
/// known, else estimate_aspect(). Errors: kInvalidInput "rectify.corners" (not convex, outside of
/// the photo, too small).
Result<Rectified> rectify(const RgbaImage& photo, const RectifyOptions& options);

}  // namespace modar
