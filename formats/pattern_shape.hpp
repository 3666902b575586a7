// The shape of a pattern that is not flat: a label around a bottle or a cup, the faces of a box. A
// section since 1.2. Bake and tracker map places of the picture to points in space by the same
// arithmetic, which has the same bits on every processor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/layout.hpp"

namespace modar {

inline constexpr std::uint32_t kMaxShapeFaces = 16;

enum class ShapeKind : std::uint32_t {
  kRound = 1,  ///< part of a cylinder or a cone, whose axis is behind the picture's middle
  kFaces = 2,  ///< flat parts of the picture, each at its place in space
};

struct PatternShapeHeader {
  std::uint32_t kind;        ///< ShapeKind
  std::uint32_t face_count;  ///< of kFaces, 1 to kMaxShapeFaces; else 0
  double half_arc;           ///< kRound: radians about the axis from the middle to the right edge
  double slope;  ///< kRound: growth of the radius by a step up along the surface, -1 to 1; 0: a
                 ///< cylinder
  std::uint32_t reserved[2];
};
static_assert(sizeof(PatternShapeHeader) == 32);

/// A rectangle of the picture and its place, in pattern units.
struct ShapeFaceRecord {
  std::uint16_t place[4];  ///< left, top, width, height: pixels of the picture
  float corner[3];         ///< its top left corner
  float right[3];          ///< its upper edge
  float down[3];           ///< its left edge
  std::uint32_t reserved;
};
static_assert(sizeof(ShapeFaceRecord) == 48);

/// A place of the picture in space, pattern units, and how it moves with the place.
struct SurfacePoint {
  std::array<double, 3> at{};
  std::array<double, 3> right{};  ///< by a pixel to the right
  std::array<double, 3> down{};   ///< by a pixel down
  std::array<double, 3> bend{};   ///< of `right`, by a pixel to the right
};

/// The surface of a pattern. Copies are cheap; faces stay in the section's bytes.
class PatternSurface {
 public:
  PatternSurface() = default;  ///< flat
  [[nodiscard]] bool flat() const { return kind_ == 0; }
  /// Of a picture of that size. half_arc: above 0, at most pi.
  static PatternSurface round(int width, int height, double half_arc, double slope);
  /// The faces must outlive it.
  static PatternSurface of_faces(int width, int height, std::span<const ShapeFaceRecord> faces);
  /// x, y: pixels, whose centres are at whole numbers. Outside the picture the surface continues.
  [[nodiscard]] SurfacePoint at(double x, double y) const;

  [[nodiscard]] double width() const { return width_; }  ///< of the picture, pixels
  [[nodiscard]] double height() const { return height_; }
  [[nodiscard]] double half_arc() const { return half_arc_; }
  [[nodiscard]] double slope() const { return slope_; }
  [[nodiscard]] double radius() const { return radius_; }  ///< in the middle, pattern units
  [[nodiscard]] std::span<const ShapeFaceRecord> faces() const { return faces_; }

 private:
  [[nodiscard]] SurfacePoint on_face(double x, double y) const;

  std::uint32_t kind_ = 0;  ///< of ShapeKind; 0: flat
  double width_ = 1;
  double height_ = 1;
  double half_arc_ = 0;
  double slope_ = 0;
  double radius_ = 0;
  double rise_ = 1;  ///< along the axis by a step along the surface
  std::span<const ShapeFaceRecord> faces_;
};

/// Views a section's bytes, which must outlive the surface. Returns what breaks a rule of
/// bundle.md but reserved fields; nullptr if nothing does. width, height: of the picture.
const char* view_pattern_shape(std::span<const std::byte> bytes, std::uint32_t width,
                               std::uint32_t height, PatternSurface& surface);

}  // namespace modar
