// Rays of one direction from many points at once: no tree, a walk over the triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <glm/vec3.hpp>

namespace modar {

/// Casts a ray along one axis from each of many points, to the side of the axis that the point's
/// normal looks to. The points form a grid across the axis; each triangle looks up those behind
/// it, so that an axis costs some 30 ns a triangle where points are as dense as its corners.
class ParallelRays {
 public:
  using Triangle = std::array<std::uint32_t, 3>;  ///< of positions

  struct Lengths {
    float from = 0;  ///< nearer triangles are not met
    float to = 0;    ///< nor are farther ones
  };

  /// Rays start at `origins`, one a normal; triangles are over `positions`. All are in [-2,2] and
  /// are the caller's.
  ParallelRays(std::span<const glm::vec3> origins, std::span<const glm::vec3> normals,
               std::span<const glm::vec3> positions, std::span<const Triangle> triangles);

  /// Casts along a direction of unit length, or against it. Rays that pass an edge within the
  /// rounding of single precision may miss both of its triangles. False where triangles cover more
  /// of the grid than kMostTried allows: nothing is found then.
  [[nodiscard]] bool cast(const glm::vec3& axis, const Lengths& lengths);

  /// What cast() found: of the ray in place i, whose it is, how directly its normal looks along the
  /// ray (cosine), and the distance of what it meets first, or `to`.
  [[nodiscard]] std::size_t size() const { return points_.size(); }
  [[nodiscard]] std::uint32_t point(std::size_t i) const { return points_[i]; }
  [[nodiscard]] float cosine(std::size_t i) const { return cosines_[i]; }
  [[nodiscard]] float distance(std::size_t i) const { return groups_[i / 4].distance[i % 4]; }

 private:
  using Four [[gnu::vector_size(16)]] = float;
  /// Across the axis, in cells, and along it.
  struct Place {
    float x = 0;
    float y = 0;
    float depth = 0;
  };
  using Corners = std::array<Place, 3>;
  struct Frame {
    glm::vec3 across;
    glm::vec3 along;
    glm::vec3 axis;
    [[nodiscard]] Place of(const glm::vec3& point) const;
  };
  /// Four points, in the order of the cells.
  struct Group {
    Four x{};
    Four y{};
    Four depth{};  ///< along the ray
    Four sign{};   ///< 1: along the axis, -1: against it
    Four distance{};
  };
  /// A triangle as functions of the place across the axis, relative to its first corner: weights of
  /// the second and the third corner, and depth.
  struct Facet {
    Four x, y, depth;
    Four b_x, b_y;
    Four c_x, c_y;
    Four depth_x, depth_y;
    bool prepare(const Corners& corners);
  };
  Place lay_grid(Frame& frame);
  void sort_points(const Frame& frame, const Place& low, float to);
  [[nodiscard]] std::uint32_t column(float x) const;
  [[nodiscard]] std::uint32_t row(float y) const;
  void meet_row(const Facet& facet, std::uint32_t row, std::uint32_t left, std::uint32_t right,
                Four from);
  [[nodiscard]] std::pair<float, float> extent_in_row(const Corners& corners,
                                                      std::uint32_t row) const;
  void meet(const Corners& corners, float from);

  std::span<const glm::vec3> origins_;
  std::span<const glm::vec3> normals_;
  std::span<const glm::vec3> positions_;
  std::span<const Triangle> triangles_;
  float last_column_ = 0;  // of the grid
  float last_row_ = 0;
  std::uint32_t columns_ = 1;
  std::size_t tried_ = 0;  // in this direction
  std::vector<Place> places_;
  std::vector<Place> origin_places_;
  std::vector<std::uint32_t> cells_;   // of each point
  std::vector<std::uint32_t> starts_;  // of the cells' points, one row after another
  // In the order of the cells:
  std::vector<std::uint32_t> points_;
  std::vector<float> cosines_;
  std::vector<Group> groups_;
};

}  // namespace modar
