// Prints on bottles, cups and boxes: the shape that the user tells, and the section that
// holds it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bake/pattern/picture.hpp"
#include "bake/pattern/plane_aspect.hpp"
#include "formats/base/error.hpp"
#include "formats/pattern_shape.hpp"

namespace modar {

/// The shape of a pattern as the user says it. Lengths in millimetres, 0: not told.
struct ShapeRequest {
  enum class Kind : std::uint8_t { kFlat, kCylinder, kCone, kBox };
  Kind kind = Kind::kFlat;
  double top_mm = 0;               ///< diameter at the picture's upper edge
  double bottom_mm = 0;            ///< and at its lower edge; a cylinder's are the same
  double arc_deg = 0;              ///< that the picture's width covers, up to 360
  std::array<double, 3> box_mm{};  ///< width, height, depth
  /// Of a box: right, back, left, top and bottom, relative to the folder of the pattern's picture,
  /// which is its front; empty: plain.
  std::array<std::string, 5> sides;
  std::string text;  ///< as written: "cylinder,diameter=66mm,arc=120"; empty: nothing was
  /// Of the picture in the photo that the pattern's file is (of a box, its front): top-left,
  /// top-right, bottom-right, bottom-left. Nothing: the file is the picture.
  std::optional<std::array<PixelPoint, 4>> corners = std::nullopt;
  double height_mm = 0;  ///< of what the corners cut out; 0: as the perspective tells
  [[nodiscard]] bool flat() const { return kind == Kind::kFlat; }
};

/// A pattern's picture in colour: what its corners cut out of the photo, as `modar pattern rectify`
/// does, or the unchanged file. width_mm: of the picture, 0: not told. Errors: those of
/// read_photo() and rectify().
Result<RgbaImage> read_pattern_picture(const std::string& path, double width_mm,
                                       const ShapeRequest& request);

/// The SectionType::kPatternShape section of a picture of that size; empty where the request is
/// flat. Not of boxes. width_mm: of the picture, along the surface; 0: filled in where the
/// diameters tell it. Errors: kUsage "pattern.shape" where the parts contradict each other or are
/// too few.
Result<std::vector<std::byte>> shape_section(const ShapeRequest& request, int width, int height,
                                             double& width_mm);

/// A pattern's picture as the tracker uses it, and its shape.
struct ShapedPicture {
  GrayPicture picture;
  bool shrunk = false;             ///< see load_pattern()
  bool width_of_file = false;      ///< width_mm is what the PNG states
  std::vector<std::byte> section;  ///< see shape_section()
  double width_mm = 0;
  double corrected = 0;     ///< of a box: see CorrectedBox
  bool cut_beyond = false;  ///< the same
};

/// Reads a pattern's picture, or the pictures of a box side by side in one. width_mm: 0: what the
/// shape tells, else what the file states. Errors: those of load_pattern(), shape_section() and
/// target_shape(); kUsage "pattern.shape" where a picture has not the proportions of its side of
/// the box.
Result<ShapedPicture> load_shaped(const std::string& path, double width_mm,
                                  const ShapeRequest& request);

/// The pictures of a box in one: front, right, back, left, top, bottom; empty: plain. Each is
/// resized to its side. box_mm: width, height and depth. longest: pixels of the longer side of the
/// whole, by default as many as other patterns have.
ShapedPicture assemble_box(const std::array<GrayPicture, 6>& pictures,
                           const std::array<double, 3>& box_mm, int longest = 720);

/// The files that the request names in addition to the pattern's own, as paths.
std::vector<std::string> files_of(const std::string& path, const ShapeRequest& request);

/// The surface of a section that shape_section() made, whose bytes outlive it; flat of an empty
/// one.
PatternSurface surface_of(const std::vector<std::byte>& section, int width, int height);

}  // namespace modar
