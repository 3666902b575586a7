// Rays through boxes that are split where the surface area heuristic says, four to a node.
#include "bake/mesh/rays/triangle_tree.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Triangles of a leaf. Both 2 and 8 are slower.
constexpr std::size_t kRayLeaf = 4;
/// Places at which a split is tried. More take time at each node, fewer miss the best split. [8,
/// 32]
constexpr int kSplitBins = 16;
/// Consecutive nodes that may split unevenly, before halving bounds the depth. More need a larger
/// stack. [10, 40]
constexpr int kUneven = 20;
constexpr std::size_t kRayStack = 3 * (kUneven + 32) + 1;
/// Of the model's side: boxes are so much larger than single precision rounds.
constexpr double kBoxSlack = 1e-6;

double half_area(const glm::dvec3& low, const glm::dvec3& high) {
  const glm::dvec3 s = high - low;
  return s.x * s.y + s.y * s.z + s.z * s.x;
}

}  // namespace

RayTree::RayTree(std::span<const glm::dvec3> positions, std::span<const Triangle> triangles)
    : source_(triangles), positions_(positions) {
  if (triangles.empty()) return;
  std::vector<Item> items(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& [p, q, r] = triangles[i];
    const glm::dvec3& a = positions[p];
    const glm::dvec3& b = positions[q];
    const glm::dvec3& c = positions[r];
    items[i].box = {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
    items[i].centre = items[i].box.low + items[i].box.high;
    items[i].triangle = static_cast<std::uint32_t>(i);
  }
  facets_.reserve(items.size());
  nodes_.reserve(items.size() / 3 + 1);
  nodes_.emplace_back();
  build(0, {items, box_of(items)}, 0);
  source_ = {};
  positions_ = {};
}

RayTree::Box RayTree::box_of(std::span<const Item> items) {
  Box box = items[0].box;
  for (const Item& item : items) {
    box.low = glm::min(box.low, item.box.low);
    box.high = glm::max(box.high, item.box.high);
  }
  return box;
}

int RayTree::BinAxis::of(const Item& item) const {
  return std::min(kSplitBins - 1, static_cast<int>((item.centre[axis] - low) * scale));
}

/// Of equal bins along an axis, the first behind the split that the surface area heuristic likes
/// best (MacDonald and Booth, "Heuristics for Ray Tracing Using Space Subdivision", 1990); 0: none.
int RayTree::best_bin(std::span<const Item> items, const BinAxis& bins) {
  constexpr double kFar = std::numeric_limits<double>::max();
  const Box none{glm::dvec3(kFar), glm::dvec3(-kFar)};
  std::array<Box, kSplitBins> boxes;
  boxes.fill(none);
  std::array<std::size_t, kSplitBins> counts{};
  const auto add = [](Box& to, const Box& box) {
    to = {glm::min(to.low, box.low), glm::max(to.high, box.high)};
  };
  for (const Item& item : items) {
    const auto bin = static_cast<std::size_t>(bins.of(item));
    add(boxes[bin], item.box);
    ++counts[bin];
  }
  std::array<double, kSplitBins> behind{};  // cost of the bins from each on
  Box box = none;
  std::size_t count = 0;
  for (std::size_t i = kSplitBins; i-- > 1;) {
    add(box, boxes[i]);
    count += counts[i];
    behind[i] = count == 0 ? 0 : half_area(box.low, box.high) * static_cast<double>(count);
  }
  box = none;
  count = 0;
  double least = kFar;
  int best = 0;
  for (std::size_t i = 1; i < kSplitBins; ++i) {
    add(box, boxes[i - 1]);
    count += counts[i - 1];
    if (count == 0 || count == items.size()) continue;
    const double cost = half_area(box.low, box.high) * static_cast<double>(count) + behind[i];
    if (cost >= least) continue;
    least = cost;
    best = static_cast<int>(i);
  }
  return best;
}

/// Sorts the items into two parts, and answers how many the first has.
std::size_t RayTree::halve(std::span<Item> items, int depth) {
  glm::dvec3 low = items[0].centre;
  glm::dvec3 high = low;
  for (const Item& item : items) {
    low = glm::min(low, item.centre);
    high = glm::max(high, item.centre);
  }
  const glm::dvec3 side = high - low;
  const int axis = side.x >= side.y && side.x >= side.z ? 0 : (side.y >= side.z ? 1 : 2);
  const BinAxis bins{axis, low[axis], kSplitBins / side[axis]};
  const int from = depth < kUneven && std::isfinite(bins.scale) ? best_bin(items, bins) : 0;
  if (from > 0) {
    const auto second = std::partition(items.begin(), items.end(),
                                       [&](const Item& item) { return bins.of(item) < from; });
    return static_cast<std::size_t>(second - items.begin());
  }
  std::nth_element(
      items.begin(), items.begin() + static_cast<std::ptrdiff_t>(items.size() / 2), items.end(),
      [axis](const Item& a, const Item& b) { return a.centre[axis] < b.centre[axis]; });
  return items.size() / 2;
}

/// At most four parts, of which those that are no leaves are as alike in size as they can be.
std::size_t RayTree::quarter(std::array<Part, 4>& parts, int depth) {
  std::size_t count = 1;
  while (count < parts.size()) {
    std::size_t next = parts.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (parts[i].items.size() <= kRayLeaf) continue;
      if (next == parts.size() || half_area(parts[i].box.low, parts[i].box.high) >
                                      half_area(parts[next].box.low, parts[next].box.high)) {
        next = i;
      }
    }
    if (next == parts.size()) break;
    const std::span<Item> items = parts[next].items;
    const std::size_t first = halve(items, depth);
    parts[count++] = {items.subspan(first), box_of(items.subspan(first))};
    parts[next] = {items.first(first), box_of(items.first(first))};
  }
  return count;
}

void RayTree::add_leaf(std::uint32_t node, std::size_t child, std::span<const Item> items) {
  nodes_[node].first[child] = static_cast<std::uint32_t>(facets_.size());
  nodes_[node].count[child] = static_cast<std::uint32_t>(items.size());
  for (const Item& item : items) {
    const Triangle& t = source_[item.triangle];
    const glm::dvec3& p = positions_[t[0]];
    facets_.push_back({p, positions_[t[1]] - p, positions_[t[2]] - p, t});
  }
}

void RayTree::build(std::uint32_t node, const Part& part, int depth) {
  std::array<Part, 4> parts;
  parts[0] = part;
  const std::size_t count = quarter(parts, depth);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Box& box = parts[i].box;
    const double slack =
        i < count ? kBoxSlack * (1 + std::max(glm::length(box.low), glm::length(box.high))) : 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<int>(axis);
      // No ray enters a box with NaN.
      constexpr float kNoBox = std::numeric_limits<float>::quiet_NaN();
      nodes_[node].low[axis][i] = i < count ? static_cast<float>(box.low[a] - slack) : kNoBox;
      nodes_[node].high[axis][i] = i < count ? static_cast<float>(box.high[a] + slack) : kNoBox;
    }
    if (i >= count) continue;
    if (parts[i].items.size() <= kRayLeaf) {
      add_leaf(node, i, parts[i].items);
      continue;
    }
    const auto child = static_cast<std::uint32_t>(nodes_.size());
    nodes_[node].first[i] = child;
    nodes_.emplace_back();
    build(child, parts[i], depth + 1);
  }
}

RayTree::Four RayTree::four(float value) {
  return Four{value, value, value, value};
}

/// Whether the ray meets the triangle between the distances, and where.
bool RayTree::meet(const Facet& facet, const glm::dvec3& origin, const glm::dvec3& direction,
                   double from, double to, std::optional<RayHit>& hit) {
  // Moeller and Trumbore, "Fast, Minimum Storage Ray-Triangle Intersection", 1997.
  const glm::dvec3 h = glm::cross(direction, facet.ac);
  const double volume = glm::dot(facet.ab, h);
  if (volume == 0) return false;
  const glm::dvec3 offset = origin - facet.corner;
  const double b = glm::dot(offset, h) / volume;
  if (b < 0 || b > 1) return false;
  const glm::dvec3 k = glm::cross(offset, facet.ab);
  const double c = glm::dot(direction, k) / volume;
  const double distance = glm::dot(facet.ac, k) / volume;
  if (c < 0 || b + c > 1 || distance < from || distance > to) return false;
  hit = RayHit{distance, facet.triangle, b, c};
  return true;
}

std::optional<RayHit> RayTree::first_hit(const glm::dvec3& origin, const glm::dvec3& direction,
                                         double from, double to) const {
  if (nodes_.empty()) return std::nullopt;
  // Finite: along an axis, infinity times no distance would be no number.
  constexpr float kParallel = 1e-30f;
  // The origin in single precision, at most and at least: boxes grow by as much.
  std::array<Four, 3> above;
  std::array<Four, 3> below;
  std::array<Four, 3> inverse;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<int>(axis);
    const float d = static_cast<float>(direction[a]);
    const float o = static_cast<float>(origin[a]);
    const float error = std::fabs(o) * std::numeric_limits<float>::epsilon();
    above[axis] = four(o + error);
    below[axis] = four(o - error);
    inverse[axis] = four(1.0f / (std::fabs(d) < kParallel ? kParallel : d));
  }
  struct Entry {
    std::uint32_t first;
    std::uint32_t count;
    float distance;
  };
  constexpr float kRound = 1e-5f;  // more than distances in single precision are off by
  std::optional<RayHit> best;
  std::array<Entry, kRayStack> stack;
  std::size_t size = 0;
  stack[size++] = {0, 0, 0.0f};
  const float least = static_cast<float>(from) * (1 - kRound);
  float most = static_cast<float>(to) * (1 + kRound);
  while (size > 0) {
    const Entry entry = stack[--size];
    if (!(entry.distance <= most)) continue;
    if (entry.count != 0) {
      for (std::uint32_t t = entry.first; t < entry.first + entry.count; ++t) {
        if (meet(facets_[t], origin, direction, from, to, best)) to = best->distance;
      }
      most = static_cast<float>(to) * (1 + kRound);
      continue;
    }
    const Node& node = nodes_[entry.first];
    Four in = four(least);
    Four out = four(most);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Four a = (node.low[axis] - above[axis]) * inverse[axis];
      const Four b = (node.high[axis] - below[axis]) * inverse[axis];
      const Four near = a < b ? a : b;
      const Four far = a < b ? b : a;
      in = in > near ? in : near;
      out = out < far ? out : far;
    }
    out *= four(1 + kRound);
    const std::size_t before = size;
    for (std::size_t i = 0; i < 4; ++i) {
      if (!(in[i] <= out[i])) continue;
      // Nearest last, where it is taken first.
      std::size_t at = size++;
      while (at > before && stack[at - 1].distance < in[i]) {
        stack[at] = stack[at - 1];
        --at;
      }
      stack[at] = {node.first[i], node.count[i], in[i]};
    }
  }
  return best;
}

}  // namespace modar
