// Trees of boxes over triangles: which triangle is nearest to a point, which does a ray meet first?
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace modar {

/// Square of the distance of a point from a triangle (Ericson, "Real-Time Collision Detection",
/// 2005, 5.1.5). Triangles without area give the distance of one of their corners or edges. Where
/// it is not below `best`, any number that is not.
double distance_square(const glm::dvec3& point, const std::array<glm::dvec3, 3>& triangle,
                       double best = std::numeric_limits<double>::infinity());

/// The point of a triangle that is nearest to another: corner 0 + b (corner 1 - corner 0) + c
/// (corner 2 - corner 0).
struct ClosestPoint {
  double square = 0;  ///< of the distance
  double b = 0;
  double c = 0;
};
ClosestPoint closest_point(const glm::dvec3& point, const std::array<glm::dvec3, 3>& triangle);

/// A bounding volume tree, split at the medians of the triangles' centres.
class TriangleTree {
 public:
  using Triangle = std::array<std::uint32_t, 3>;  ///< of positions

  /// At least one triangle, every index below positions.size(). The positions are the caller's and
  /// must outlive the tree.
  TriangleTree(std::span<const glm::dvec3> positions, std::vector<Triangle> triangles);

  /// Square of the distance of the nearest triangle; where some triangle is within `enough` (a
  /// square), that of any such triangle; where none is nearer than `best`, that. Remembers the
  /// answer: neighbouring points ask for it again.
  double nearest(const glm::dvec3& point, double enough = 0,
                 double best = std::numeric_limits<double>::infinity());
  /// The triangle that nearest() answered last.
  [[nodiscard]] const Triangle& last_triangle() const { return triangles_[last_]; }

 private:
  struct Node {
    glm::dvec3 low;
    glm::dvec3 high;
    std::uint32_t first = 0;  // leaf: triangle; else the left child, the right one behind it
    std::uint32_t count = 0;  // of triangles; 0: an inner node
  };
  [[nodiscard]] std::array<glm::dvec3, 3> corners(std::uint32_t t) const {
    const Triangle& v = triangles_[t];
    return {positions_[v[0]], positions_[v[1]], positions_[v[2]]};
  }
  struct Centre {
    glm::dvec3 sum;  // of the corners
    Triangle triangle;
  };
  void build(std::uint32_t node, std::uint32_t first, std::span<Centre> centres);

  std::span<const glm::dvec3> positions_;
  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
  std::uint32_t last_ = 0;
};

/// What a ray meets first.
struct RayHit {
  double distance = 0;  ///< in lengths of the direction
  std::array<std::uint32_t, 3> triangle{};
  double b = 0;  ///< weights of the second and the third corner
  double c = 0;
};

/// Nodes of four boxes in single precision, which a ray tries at once; triangles are met in double
/// precision, so that the boxes decide how long a ray takes and never what it meets.
class RayTree {
 public:
  using Triangle = std::array<std::uint32_t, 3>;  ///< of positions

  /// Every index below positions.size(); no triangle: rays meet nothing. Keeps copies of corners:
  /// 88 bytes a triangle, and some 60 of nodes.
  RayTree(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles);

  /// The first triangle, from either side, that the ray meets between two distances. Changes
  /// nothing: any number of threads may ask.
  [[nodiscard]] std::optional<RayHit> first_hit(const glm::dvec3& origin,
                                                const glm::dvec3& direction, double from,
                                                double to) const;

 private:
  using Four [[gnu::vector_size(16)]] = float;
  struct Node {
    std::array<Four, 3> low;
    std::array<Four, 3> high;
    std::array<std::uint32_t, 4> first{};  // leaf: triangle; else the child's node
    std::array<std::uint32_t, 4> count{};  // of triangles; 0: an inner node
  };
  /// The first corner and the sides from it.
  struct Facet {
    glm::dvec3 corner;
    glm::dvec3 ab;
    glm::dvec3 ac;
    Triangle triangle;
  };
  struct Box {
    glm::dvec3 low;
    glm::dvec3 high;
  };
  struct Item {
    Box box;
    glm::dvec3 centre;  // twice
    std::uint32_t triangle = 0;
  };
  struct Part {
    std::span<Item> items;
    Box box;
  };
  struct BinAxis {
    int axis = 0;
    double low = 0;
    double scale = 0;  // bins a length
    [[nodiscard]] int of(const Item& item) const;
  };
  static Four four(float value);
  static Box box_of(std::span<const Item> items);
  static int best_bin(std::span<const Item> items, const BinAxis& bins);
  static std::size_t halve(std::span<Item> items, int depth);
  static std::size_t quarter(std::array<Part, 4>& parts, int depth);
  static bool meet(const Facet& facet, const glm::dvec3& origin, const glm::dvec3& direction,
                   double from, double to, std::optional<RayHit>& hit);
  void add_leaf(std::uint32_t node, std::size_t child, std::span<const Item> items);
  void build(std::uint32_t node, const Part& part, int depth);

  std::span<const Triangle> source_;
  std::span<const glm::dvec3> positions_;
  std::vector<Node> nodes_;
  std::vector<Facet> facets_;
};

}  // namespace modar
