#include "bake/mesh/upright.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

// The limits below were chosen on 782 upright pieces of furniture (Debian's sweethome3d-furniture),
// none of which they turn over, and on 34 scans, scenes and game models.

/// Map coordinates are at least that many largest sides away from the origin, ...
constexpr double kFarSides = 100.0;
/// ... and the height at most this share of the nearer one of the other two.
constexpr double kHeightShare = 0.02;
/// Share of the area that an open ground shows from above more than from below. Scanned walls have
/// 0.6, outdoor scenes 0.9.
constexpr double kGroundShare = 0.8;
/// Ground is at most as high as this share of its longer side.
constexpr double kGroundHeight = 0.5;
/// How far from the end of the box points still touch the ground, of the diagonal.
constexpr double kTouch = 0.01;
/// Of the box's footprint: what the points that touch the ground enclose, at least, ...
constexpr double kBaseShare = 0.25;
/// ... more than at the other end, ...
constexpr double kBaseGap = 0.15;
/// ... and at most where a shape does not stand.
constexpr double kNoBase = 0.15;

struct Point {
  double x, y;
};

double cross(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Area of the convex hull (Andrew's monotone chain). Reorders the points.
double hull_area(std::vector<Point>& points) {
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Point> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t start = hull.size();
    for (const Point& point : points) {
      while (hull.size() >= start + 2 &&
             cross(hull[hull.size() - 2], hull[hull.size() - 1], point) <= 0) {
        hull.pop_back();
      }
      hull.push_back(point);
    }
    if (!hull.empty()) hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  double doubled = 0;
  for (std::size_t i = 1; i + 1 < hull.size(); ++i) doubled += cross(hull[0], hull[i], hull[i + 1]);
  return std::fabs(doubled) / 2;
}

/// What the axes are compared by. Lengths are those of the mesh in [-1,1].
struct Shape {
  glm::dvec3 least{1e9};
  glm::dvec3 greatest{-1e9};
  glm::dvec3 facing{0.0};    ///< sum of the triangles' area vectors over their area
  glm::dvec3 centroid{0.5};  ///< of the area, 0 to 1 along the box's sides

  [[nodiscard]] glm::dvec3 sides() const { return greatest - least; }
};

Shape measure(const TriMesh& mesh) {
  Shape shape;
  glm::dvec3 vectors{0.0};
  glm::dvec3 moment{0.0};
  double area = 0;
  for (const auto& triangle : mesh.triangles) {
    const glm::dvec3& a = mesh.positions[triangle[0]];
    const glm::dvec3& b = mesh.positions[triangle[1]];
    const glm::dvec3& c = mesh.positions[triangle[2]];
    for (const glm::dvec3& p : {a, b, c}) {
      shape.least = glm::min(shape.least, p);
      shape.greatest = glm::max(shape.greatest, p);
    }
    const glm::dvec3 vector = glm::cross(b - a, c - a);
    const double doubled = glm::length(vector);
    vectors += vector;
    moment += doubled * (a + b + c);
    area += doubled;
  }
  if (!(area > 0)) return shape;
  shape.facing = vectors / area;
  for (int i = 0; i < 3; ++i) {
    if (shape.sides()[i] > 0) {
      shape.centroid[i] = (moment[i] / (3 * area) - shape.least[i]) / shape.sides()[i];
    }
  }
  return shape;
}

/// What the points within kTouch of an end of the box enclose there, as a share of the box's
/// footprint along that axis.
double base_share(const TriMesh& mesh, const Shape& shape, int axis, bool upper_end) {
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  const double footprint = shape.sides()[u] * shape.sides()[v];
  if (!(footprint > 0)) return 0;
  const double end = upper_end ? shape.greatest[axis] : shape.least[axis];
  const double touch = kTouch * glm::length(shape.sides());
  std::vector<Point> points;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      const glm::dvec3& p = mesh.positions[vertex];
      if (std::fabs(p[axis] - end) < touch) points.push_back({p[u], p[v]});
    }
  }
  return hull_area(points) / footprint;
}

/// Map coordinates: the axis of the height, or -1.
int height_of_map(const TriMesh& mesh) {
  const glm::dvec3 far = glm::abs(mesh.placement.center);
  const double most = kFarSides * 2 * mesh.placement.scale;
  for (const int up : {2, 1}) {
    const double nearer = std::min(far[0], far[3 - up]);
    if (nearer > most && far[up] < kHeightShare * nearer) return up;
  }
  return -1;
}

bool is_ground(const Shape& shape, int up) {
  const glm::dvec3 sides = shape.sides();
  const double longer = std::max(sides[0], sides[3 - up]);
  return shape.facing[up] >= kGroundShare && sides[up] <= kGroundHeight * longer &&
         sides[up] > kFlatShare * longer;
}

/// Taller than wide along `up`, with a base at its lower end and none along `other`.
bool stands_on_base(const TriMesh& mesh, const Shape& shape, int up, int other) {
  const glm::dvec3 sides = shape.sides();
  if (sides[up] <= std::max(sides[0], sides[other]) || shape.centroid[up] >= 0.5) return false;
  const double base = base_share(mesh, shape, up, false);
  return base > kBaseShare && base > base_share(mesh, shape, up, true) + kBaseGap &&
         base_share(mesh, shape, other, false) < kNoBase &&
         base_share(mesh, shape, other, true) < kNoBase;
}

constexpr UpAxis axis_of(int index) {
  return index == 1 ? UpAxis::kY : UpAxis::kZ;
}

}  // namespace

Upright find_up(const TriMesh& mesh) {
  if (mesh.up.reason != UpReason::kConvention) return mesh.up;
  if (const int up = height_of_map(mesh); up >= 0) return {axis_of(up), UpReason::kGeoreferenced};
  const Shape shape = measure(mesh);
  const int usual = mesh.up.axis == UpAxis::kZ ? 2 : 1;
  const int other = 3 - usual;
  if (is_ground(shape, other)) return {axis_of(other), UpReason::kGround};
  if (stands_on_base(mesh, shape, other, usual)) return {axis_of(other), UpReason::kBase};
  return mesh.up;
}

}  // namespace modar
