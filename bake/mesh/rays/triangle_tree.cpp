// Median-split boxes, searched nearest box first.
#include "bake/mesh/rays/triangle_tree.hpp"

#include <algorithm>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Triangles of a leaf. Fewer make more nodes, more test triangles in vain. [2, 8]
constexpr std::uint32_t kLeaf = 4;
/// Of the squared lengths of two sides: triangles of a lesser squared area have no plane.
constexpr double kFlat = 1e-18;

double square(const glm::dvec3& v) {
  return glm::dot(v, v);
}

double box_distance_square(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high) {
  return square(glm::max(glm::max(low - p, p - high), glm::dvec3(0.0)));
}

/// How far along the segment from a to b its nearest point is, 0 to 1.
double along_segment(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 ab = b - a;
  const double length = square(ab);
  return length > 0 ? std::clamp(glm::dot(p - a, ab) / length, 0.0, 1.0) : 0.0;
}

ClosestPoint closest_of_degenerate(const glm::dvec3& p, const std::array<glm::dvec3, 3>& t) {
  const double ab = along_segment(p, t[0], t[1]);
  const double ac = along_segment(p, t[0], t[2]);
  const double bc = along_segment(p, t[1], t[2]);
  return std::min({ClosestPoint{square(p - glm::mix(t[0], t[1], ab)), ab, 0.0},
                   ClosestPoint{square(p - glm::mix(t[0], t[2], ac)), 0.0, ac},
                   ClosestPoint{square(p - glm::mix(t[1], t[2], bc)), 1.0 - bc, bc}},
                  [](const ClosestPoint& x, const ClosestPoint& y) { return x.square < y.square; });
}

/// Where the distance is not below `best`, the distance from the plane may do.
inline ClosestPoint closest_of(const glm::dvec3& p, const std::array<glm::dvec3, 3>& t,
                               double best) {
  const glm::dvec3 ab = t[1] - t[0];
  const glm::dvec3 ac = t[2] - t[0];
  const glm::dvec3 n = glm::cross(ab, ac);
  const double area = square(n);
  const glm::dvec3 ap = p - t[0];
  if (!(area > kFlat * square(ab) * square(ac))) return closest_of_degenerate(p, t);
  const double height = glm::dot(ap, n);
  const double plane = height * height / area;
  if (plane >= best) return {plane, 0, 0};
  // The region of the corner, edge or inside that is nearest to the point.
  const double ab_ap = glm::dot(ab, ap);
  const double ac_ap = glm::dot(ac, ap);
  if (ab_ap <= 0 && ac_ap <= 0) return {square(ap), 0, 0};
  const glm::dvec3 bp = p - t[1];
  const double ab_bp = glm::dot(ab, bp);
  const double ac_bp = glm::dot(ac, bp);
  if (ab_bp >= 0 && ac_bp <= ab_bp) return {square(bp), 1, 0};
  const double of_c = ab_ap * ac_bp - ab_bp * ac_ap;
  if (ab_ap >= 0 && ab_bp <= 0 && of_c <= 0) {
    const double b = ab_ap / (ab_ap - ab_bp);
    return {square(ap - ab * b), b, 0};
  }
  const glm::dvec3 cp = p - t[2];
  const double ab_cp = glm::dot(ab, cp);
  const double ac_cp = glm::dot(ac, cp);
  if (ac_cp >= 0 && ab_cp <= ac_cp) return {square(cp), 0, 1};
  const double of_b = ab_cp * ac_ap - ab_ap * ac_cp;
  if (ac_ap >= 0 && ac_cp <= 0 && of_b <= 0) {
    const double c = ac_ap / (ac_ap - ac_cp);
    return {square(ap - ac * c), 0, c};
  }
  const double from_b = ac_bp - ab_bp;
  const double from_c = ab_cp - ac_cp;
  if (from_b >= 0 && from_c >= 0 && ab_bp * ac_cp <= ab_cp * ac_bp) {
    const double c = from_b / (from_b + from_c);
    return {square(bp - (t[2] - t[1]) * c), 1 - c, c};
  }
  return {plane, of_b / area, of_c / area};
}

}  // namespace

double distance_square(const glm::dvec3& p, const std::array<glm::dvec3, 3>& t, double best) {
  return closest_of(p, t, best).square;
}

ClosestPoint closest_point(const glm::dvec3& p, const std::array<glm::dvec3, 3>& t) {
  return closest_of(p, t, std::numeric_limits<double>::infinity());
}

TriangleTree::TriangleTree(std::span<const glm::dvec3> positions, std::vector<Triangle> triangles)
    : positions_(positions), triangles_(std::move(triangles)) {
  std::vector<Centre> centres;
  centres.reserve(triangles_.size());
  for (const Triangle& t : triangles_) {
    centres.push_back({positions_[t[0]] + positions_[t[1]] + positions_[t[2]], t});
  }
  nodes_.reserve(triangles_.size());
  nodes_.emplace_back();
  build(0, 0, centres);
}

void TriangleTree::build(std::uint32_t node, std::uint32_t first, std::span<Centre> centres) {
  const std::size_t count = centres.size();
  if (count <= kLeaf) {
    Node leaf{positions_[centres[0].triangle[0]], positions_[centres[0].triangle[0]], first,
              static_cast<std::uint32_t>(count)};
    for (const Centre& centre : centres) {
      triangles_[first++] = centre.triangle;
      for (const std::uint32_t v : centre.triangle) {
        leaf.low = glm::min(leaf.low, positions_[v]);
        leaf.high = glm::max(leaf.high, positions_[v]);
      }
    }
    nodes_[node] = leaf;
    return;
  }
  glm::dvec3 low = centres[0].sum;
  glm::dvec3 high = low;
  for (const Centre& centre : centres) {
    low = glm::min(low, centre.sum);
    high = glm::max(high, centre.sum);
  }
  const glm::dvec3 side = high - low;
  const int axis = side.x >= side.y && side.x >= side.z ? 0 : (side.y >= side.z ? 1 : 2);
  std::nth_element(centres.begin(), centres.begin() + static_cast<std::ptrdiff_t>(count / 2),
                   centres.end(),
                   [axis](const Centre& a, const Centre& b) { return a.sum[axis] < b.sum[axis]; });
  const auto left = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  build(left, first, centres.first(count / 2));
  build(left + 1, first + static_cast<std::uint32_t>(count / 2), centres.subspan(count / 2));
  nodes_[node] = {glm::min(nodes_[left].low, nodes_[left + 1].low),
                  glm::max(nodes_[left].high, nodes_[left + 1].high), left, 0};
}

double TriangleTree::nearest(const glm::dvec3& point, double enough, double best) {
  best = std::min(best, distance_square(point, corners(last_)));
  if (best <= enough) return best;
  struct Entry {
    std::uint32_t node;
    double distance;
  };
  std::array<Entry, 64> stack;  // two entries a level; halving 2^32 triangles takes 32 levels
  std::size_t size = 0;
  stack[size++] = {0, box_distance_square(point, nodes_[0].low, nodes_[0].high)};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.distance >= best) continue;
    const Node& node = nodes_[entry.node];
    for (std::uint32_t t = node.first; t < node.first + node.count; ++t) {
      const double distance = distance_square(point, corners(t), best);
      if (distance >= best) continue;
      best = distance;
      last_ = t;
      if (best <= enough) return best;
    }
    if (node.count != 0) continue;
    const Node& left = nodes_[node.first];
    const Node& right = nodes_[node.first + 1];
    Entry near{node.first, box_distance_square(point, left.low, left.high)};
    Entry far{node.first + 1, box_distance_square(point, right.low, right.high)};
    if (far.distance < near.distance) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
  return best;
}

}  // namespace modar
