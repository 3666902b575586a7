// The place of a flat, four-sided object in a photo.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "bake/image/image.hpp"
#include "bake/pattern/rectify.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// Most rendered photos that came out wrong were below it (see find_corners.cpp).
inline constexpr double kDoubtfulSharpness = 0.92;
/// Of sides that divide an object from its background, and of their sharpness then.
inline constexpr double kClear = 0.8;
inline constexpr double kClearEdge = 0.9;
/// The same of sides that nearly all divide, where their weakest quarter is sharp to a share.
inline constexpr double kClearAll = 0.95;
inline constexpr double kClearQuarter = 0.76;
/// Of sides that divide an object from a background with edges around it.
inline constexpr double kClearFramed = 0.99;
/// Of each quarter of sides that the background tells nothing of: below, one of their ends may be
/// on another edge.
inline constexpr double kSureQuarter = 0.86;
/// Of the ends of sides: below, a corner is cut off, as where the side of a box is seen.
inline constexpr double kLeastEnds = 0.78;

struct FoundCorners {
  std::array<PixelPoint, 4> corners{};  ///< top-left, top-right, bottom-right, bottom-left
  /// Share of the weakest side where the edge is sharp, 0 to 1; below kDoubtfulSharpness the figure
  /// may be another object's, or a corner is hidden.
  double sharpness = 0;
  double quarter = 0;  ///< the same of the weakest quarter of a side
  double ends = 0;     ///< the same at the weakest corner: of its better side
  /// Share of the weakest side on which the foreground ends, 0 to 1.
  double divided = 0;
  bool rivalled = false;  ///< another object of its size has contrast
  bool holds = false;     ///< another object is on it: it may be the table
  bool framed = false;  ///< another figure surrounds it, or two of its edges continue: it may be a
                        ///< part of that
  bool bordered = false;  ///< edges are around it at equal distances: it may be within a border
  bool fills = false;     ///< nearly all of the photo, which may be the picture itself
  /// Whether the corners are those of the foreground: then edges around it are
  /// the background's.
  [[nodiscard]] bool clear() const {
    return (divided >= kClear && sharpness >= kClearEdge) ||
           (divided >= kClearAll && quarter >= kClearQuarter);
  }
  /// Why they may be wrong: "blurred", "framed", "rivalled" or "fills"; empty: they are sure.
  [[nodiscard]] const char* doubt() const {
    if (holds || (clear() && rivalled)) return "rivalled";
    const bool sharp = divided > 0 ? sharpness >= kDoubtfulSharpness : quarter >= kSureQuarter;
    if ((!clear() && !sharp) || ends < kLeastEnds) return "blurred";
    if (bordered || (framed && !(clear() && divided >= kClearFramed))) return "framed";
    return fills ? "fills" : "";
  }
};

/// The largest four-sided figure whose sides stand out all along: straight segments (LSD: von Gioi,
/// Jakubowicz, Morel and Randall, "LSD: a line segment detector", IPOL 2012) are joined to lines,
/// lines to figures, and the best one's sides are fitted to the photo's edges to sub-pixels, those
/// of the object rather than of a frame printed on it. Which corner is the object's own top-left
/// nobody can tell: it is taken to be upright. Errors: kInvalidInput "rectify.not-found", where no
/// figure stands out sharply, two do, or a corner is outside the photo.
Result<FoundCorners> find_corners(const RgbaImage& photo);

/// The picture of a pattern in its file.
struct FoundPicture {
  /// To 0.01 pixels, see FoundCorners; nothing: the file is the picture.
  std::optional<std::array<PixelPoint, 4>> corners;
  const char* doubt =
      "";  ///< why that may be wrong: as above, "not-found", "object" or "part"; empty: it is sure
};
FoundPicture find_picture(const Photo& photo, const Result<FoundCorners>& found);
/// The doubt in words for a message: "an edge is hidden or blurred".
std::string_view doubt_words(std::string_view doubt);

/// The photo, at most 1,200 pixels wide, with the figure and its corners' numbers drawn on it.
Result<RgbaImage> corners_picture(const RgbaImage& photo, const std::array<PixelPoint, 4>& corners);

}  // namespace modar
