// How small a level must be drawn before its picture is that of the finest one. Internal to lod.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "bake/mesh/tri_mesh.hpp"

namespace modar {

/// What a mesh shows at a point.
struct Look {
  glm::dvec3 normal{0.0};  ///< as blended, not of unit length
  glm::dvec3 colour{0.0};  ///< of 255, as stored, and by how much occlusion changes the picture
  glm::dvec2 uv{0.0};
};

/// At the point of a triangle with barycentric coordinates 1 - b - c, b, c. corners: vertices of
/// the mesh.
Look look_at(const TriMesh& mesh, const std::array<std::uint32_t, 3>& corners, double b, double c);

/// A level's look at a point of the finest one, less what the finest has there.
struct LookDifference {
  glm::vec3 normal{0.0f};
  glm::vec3 colour{0.0f};  ///< of 255, as stored
  glm::vec2 slide{0.0f};   ///< of the texture, as a length on the surface
  float area = 0;          ///< that the point represents; 0: nothing is known of it

  LookDifference() = default;
  /// length_of_uv: on the surface, 0 where no texture is seen.
  LookDifference(const Look& there, const Look& here, double length_of_uv, double of_area)
      : normal(there.normal - here.normal),
        colour(there.colour - here.colour),
        slide(length_of_uv * (there.uv - here.uv)),
        area(static_cast<float>(of_area)) {}
  void operator+=(const LookDifference& other) {
    normal += other.normal;
    colour += other.colour;
    slide += other.slide;
    area += other.area;
  }
};

/// Points of a surface in cells, each of which represents a pixel: halves of a box, again and
/// again.
class PixelCells {
 public:
  explicit PixelCells(std::span<const glm::dvec3> points);

  /// Side of the smallest pixel, in the points' unit, over which differences average out: pixels of
  /// a picture of all of them differ by less than 1.5 of 255 in the mean. 0: any pixel will do, as
  /// 99 % of the area differ by less. Larger than the points' box where even that differs by more,
  /// the more the larger. differences: one a point.
  [[nodiscard]] double smallest_pixel(std::span<const LookDifference> differences);

 private:
  /// What pixels show that are the box halved so often.
  struct Shown {
    double mean = 0;   ///< of 255
    double share = 0;  ///< of the area, that shows more than is seen
  };
  [[nodiscard]] Shown shown_in(unsigned bits) const;
  [[nodiscard]] double shown_at_once() const;

  struct Place {
    std::uint32_t cell = 0;  ///< three bits a halving, the coarsest first
    std::uint32_t point = 0;
  };
  double side_ = 0;  ///< of the box
  std::vector<Place> places_;
  std::vector<LookDifference> weighed_;  ///< by area, in the order of places_
  /// Halvings to the last answer's cells, where the next search begins: the levels of one surface
  /// come one after another. The first begins where five scans end, 3 to 6.
  unsigned bits_ = 5;
};

}  // namespace modar
