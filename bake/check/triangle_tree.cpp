// Builds the tree from the top, walks it nearest box first.
#include "bake/check/triangle_tree.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

constexpr std::uint32_t kLeafTriangles = 4;

double box_distance2(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high) {
  const glm::dvec3 off = glm::max(glm::max(low - p, p - high), glm::dvec3(0.0));
  return glm::dot(off, off);
}

glm::dvec3 nearest_on_segment(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 ab = b - a;
  const double square = glm::dot(ab, ab);
  const double t = square > 0 ? glm::clamp(glm::dot(p - a, ab) / square, 0.0, 1.0) : 0.0;
  return a + t * ab;
}

}  // namespace

glm::dvec3 nearest_on_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                               const glm::dvec3& c) {
  const glm::dvec3 ab = b - a;
  const glm::dvec3 ac = c - a;
  const glm::dvec3 n = glm::cross(ab, ac);
  const double square = glm::dot(n, n);
  if (square > 0) {
    // Barycentric coordinates of the foot of the perpendicular.
    const glm::dvec3 ap = p - a;
    const double v = glm::dot(glm::cross(ap, ac), n) / square;
    const double w = glm::dot(glm::cross(ab, ap), n) / square;
    if (v >= 0 && w >= 0 && v + w <= 1) return a + v * ab + w * ac;
  }
  const std::array<glm::dvec3, 3> edges = {nearest_on_segment(p, a, b), nearest_on_segment(p, b, c),
                                           nearest_on_segment(p, c, a)};
  return *std::min_element(edges.begin(), edges.end(), [&p](const auto& x, const auto& y) {
    return glm::dot(x - p, x - p) < glm::dot(y - p, y - p);
  });
}

TriangleTree::TriangleTree(std::span<const glm::dvec3> positions,
                           std::span<const Triangle> triangles)
    : positions_(positions), triangles_(triangles) {
  centres_.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    centres_.push_back((positions[t[0]] + positions[t[1]] + positions[t[2]]) / 3.0);
  }
  order_.resize(triangles.size());
  std::iota(order_.begin(), order_.end(), 0u);
  build(0, static_cast<std::uint32_t>(triangles.size()));
}

std::uint32_t TriangleTree::build(std::uint32_t first, std::uint32_t end) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high = -low;
  glm::dvec3 centre_low = low;
  glm::dvec3 centre_high = high;
  for (std::uint32_t i = first; i < end; ++i) {
    for (const std::uint32_t v : triangles_[order_[i]]) {
      low = glm::min(low, positions_[v]);
      high = glm::max(high, positions_[v]);
    }
    centre_low = glm::min(centre_low, centres_[order_[i]]);
    centre_high = glm::max(centre_high, centres_[order_[i]]);
  }
  nodes_[index].low = low;
  nodes_[index].high = high;
  if (end - first <= kLeafTriangles) {
    nodes_[index].first = first;
    nodes_[index].count = end - first;
    return index;
  }
  const glm::dvec3 side = centre_high - centre_low;
  const int axis = side.x >= side.y && side.x >= side.z ? 0 : (side.y >= side.z ? 1 : 2);
  const std::uint32_t middle = first + (end - first) / 2;
  const auto at = [this](std::uint32_t i) {
    return order_.begin() + static_cast<std::ptrdiff_t>(i);
  };
  std::nth_element(at(first), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
    return centres_[a][axis] < centres_[b][axis];
  });
  build(first, middle);
  const std::uint32_t second = build(middle, end);
  nodes_[index].first = second;
  return index;
}

TriangleTree::Nearest TriangleTree::nearest(const glm::dvec3& point) const {
  Nearest best;
  double best2 = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> stack = {0};
  while (!stack.empty()) {
    const std::uint32_t index = stack.back();
    stack.pop_back();
    const Node& node = nodes_[index];
    if (box_distance2(point, node.low, node.high) >= best2) continue;
    if (node.count == 0) {
      const Node& a = nodes_[index + 1];
      const Node& b = nodes_[node.first];
      const bool a_first =
          box_distance2(point, a.low, a.high) <= box_distance2(point, b.low, b.high);
      stack.push_back(a_first ? node.first : index + 1);
      stack.push_back(a_first ? index + 1 : node.first);
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Triangle& t = triangles_[order_[i]];
      const glm::dvec3 q =
          nearest_on_triangle(point, positions_[t[0]], positions_[t[1]], positions_[t[2]]);
      const double square = glm::dot(q - point, q - point);
      if (square >= best2) continue;
      best2 = square;
      best = {0, order_[i], q};
    }
  }
  best.distance = glm::length(best.point - point);
  return best;
}

}  // namespace modar
