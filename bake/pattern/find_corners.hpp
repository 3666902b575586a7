// Where a flat, four-sided thing lies in a photo.
#pragma once

#include <array>

#include "bake/image/image.hpp"
#include "bake/pattern/rectify.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// Most rendered photos that came out wrong were below it (see find_corners.cpp).
inline constexpr double kDoubtfulSharpness = 0.92;

struct FoundCorners {
  std::array<PixelPoint, 4> corners{};  ///< top-left, top-right, bottom-right, bottom-left
  /// Share of the weakest side where the edge is sharp, 0 to 1; below kDoubtfulSharpness the figure
  /// may be another thing's, or a corner is hidden.
  double sharpness = 0;
  bool framed = false;  ///< another figure lies around it, or two of its edges go on: it may be a
                        ///< part of that
  bool fills = false;   ///< nearly all of the photo, which may be the picture itself
};

/// The largest four-sided figure whose sides stand out all along: straight segments (LSD: von Gioi,
/// Jakubowicz, Morel and Randall, "LSD: a line segment detector", IPOL 2012) are joined to lines,
/// lines to figures, and the best one's sides are fitted to the photo's edges to sub-pixels, those
/// of the thing rather than of a frame printed on it. Which corner is the thing's own top-left
/// nobody can tell: it is taken to be upright. Errors: kInvalidInput "rectify.not-found", where no
/// figure stands out sharply or two do.
Result<FoundCorners> find_corners(const RgbaImage& photo);

/// The photo, at most 1,200 pixels wide, with the figure and its corners' numbers drawn on it.
Result<RgbaImage> corners_picture(const RgbaImage& photo, const std::array<PixelPoint, 4>& corners);

}  // namespace modar
