// `modar pattern rectify`: from a photo of a flat object to its frontal picture.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "bake/image/image.hpp"
#include "formats/error.hpp"

namespace modar {

struct PixelPoint {
  double x = 0;
  double y = 0;
};

struct RectifyOptions {
  /// In the photo: top-left, top-right, bottom-right, bottom-left of the pattern.
  std::array<PixelPoint, 4> corners{};
  double width_mm = 0;   ///< physical width, 0: unknown
  double height_mm = 0;  ///< physical height; 0: estimated from the perspective
  std::uint32_t max_side =
      720;  ///< pixels of the longer side of the result, never more than the photo has
  [[nodiscard]] Result<void> validate() const;
};

/// A frontal view of the quadrilateral. Its aspect ratio is that of the sizes in mm where both are
/// known, else follows from the perspective (Zhang & He, "Whiteboard scanning", 2006, with the
/// principal point in the photo's centre), else from the sides' lengths. Errors: kInvalidInput
/// "rectify.corners" (not convex, outside of the photo, too small).
Result<RgbaImage> rectify(const RgbaImage& photo, const RectifyOptions& options);

}  // namespace modar
