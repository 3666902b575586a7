// Corners sorted by vertex, and walks over the triangles.
#include "bake/mesh/lod/level_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace modar {
namespace {

/// Mean triangles of a box of the nearest-triangle search. More scan longer lists, fewer visit more
/// boxes. [8, 32] tuned: lod
constexpr double kBoxed = 16;
constexpr double kMostCells = 48;
/// Steps of a walk to the nearest triangle; longer walks end where they are. Three levels apart,
/// about five are needed. tuned: lod
constexpr int kMostWalked = 24;
/// Triangles around a vertex that a search visits before a tree takes over. Higher is slow where
/// hundreds of triangles share a vertex. [16, 64] tuned: lod
constexpr std::uint32_t kWidestFan = 32;
/// Triangles and boxes that all searches of a surface look at, without and for each triangle:
/// bounds the time where boxes overlap. Models need up to 13 million.
constexpr std::size_t kMostLooked = 20'000'000;
constexpr std::size_t kLookedATriangle = 300;

}  // namespace

template <class Index>
BasicLevelSurface<Index>::BasicLevelSurface(std::span<const glm::dvec3> positions,
                                            std::span<const Index> indices)
    : positions_(positions),
      indices_(indices),
      begins_(positions.size() + 2, 0),
      corners_(indices.size()),
      ends_(indices.size()),
      opposites_(indices.size(), kNoIndex) {
  for (const Index v : indices) ++begins_[v + std::size_t{2}];
  std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
  for (std::uint32_t t = 0; t < indices.size(); t += 3) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t place = begins_[indices[t + k] + std::size_t{1}]++;
      corners_[place] = t + k;
      ends_[place] = indices[t + (k == 2 ? 0 : k + 1)];
    }
  }
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    if (fan_size(static_cast<Index>(v)) <= kWidestFan) continue;
    if (by_end_.empty()) by_end_ = corners_;
    std::sort(by_end_.begin() + begins_[v], by_end_.begin() + begins_[v + 1],
              [&](std::uint32_t a, std::uint32_t b) {
                return std::pair(indices_[next_corner(a)], a) <
                       std::pair(indices_[next_corner(b)], b);
              });
  }
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    for (std::uint32_t i = begins_[v]; i < begins_[v + 1]; ++i) {
      if (ends_[i] < v) continue;
      const std::uint32_t back = edge(ends_[i], static_cast<Index>(v));
      if (back == kNoIndex || edge(static_cast<Index>(v), ends_[i]) == kNoIndex) continue;
      opposites_[corners_[i]] = back;
      opposites_[back] = corners_[i];
    }
  }
}

/// Is the answer true for a corner whose edge goes from a vertex to another? In their order.
template <class Index>
template <class Callback>
bool BasicLevelSurface<Index>::any_edge(Index from, Index to, const Callback& callback) const {
  const std::uint32_t begin = begins_[from];
  const std::uint32_t size = fan_size(from);
  if (size <= kWidestFan) {
    for (std::uint32_t i = begin; i < begin + size; ++i) {
      if (ends_[i] == to && callback(corners_[i])) return true;
    }
    return false;
  }
  const auto end_of = [this](std::uint32_t corner) { return indices_[next_corner(corner)]; };
  const auto end = by_end_.begin() + begin + size;
  auto at = std::lower_bound(by_end_.begin() + begin, end, to,
                             [&](std::uint32_t corner, Index v) { return end_of(corner) < v; });
  for (; at != end && end_of(*at) == to; ++at) {
    if (callback(*at)) return true;
  }
  return false;
}

template <class Index>
std::uint32_t BasicLevelSurface<Index>::edge(Index from, Index to) const {
  std::uint32_t found = kNoIndex;
  const bool several = any_edge(
      from, to, [&](std::uint32_t corner) { return std::exchange(found, corner) != kNoIndex; });
  return several ? kNoIndex : found;
}

template <class Index>
bool BasicLevelSurface<Index>::has_edge(Index from, Index to) const {
  return any_edge(from, to, [](std::uint32_t) { return true; });
}

template <class Index>
std::uint32_t BasicLevelSurface<Index>::find(Index a, Index b, Index c) const {
  // Around the vertex that has the fewest.
  if (fan_size(b) < fan_size(a) || fan_size(c) < fan_size(a)) {
    return fan_size(b) <= fan_size(c) ? find(b, c, a) : find(c, a, b);
  }
  std::uint32_t found = kNoIndex;
  any_edge(a, b, [&](std::uint32_t corner) {
    if (indices_[next_corner(next_corner(corner))] == c) found = corner / 3;
    return found != kNoIndex;
  });
  return found;
}

template <class Index>
std::vector<std::uint32_t> BasicLevelSurface<Index>::triangles_of_vertices() const {
  std::vector<std::uint32_t> result(positions_.size(), kNoIndex);
  for (std::size_t c = 0; c < indices_.size(); ++c) {
    result[indices_[c]] = static_cast<std::uint32_t>(c / 3);
  }
  return result;
}

template <class Index>
std::uint32_t BasicLevelSurface<Index>::walk(const glm::dvec3& point, std::uint32_t start) const {
  std::uint32_t at = start;
  std::uint32_t before = kNoIndex;
  for (int steps = 0; steps < kMostWalked; ++steps) {
    const std::array<glm::dvec3, 3> t = triangle(at);
    const glm::dvec3 sides[3] = {t[1] - t[0], t[2] - t[1], t[0] - t[2]};
    const glm::dvec3 normal = glm::cross(sides[0], sides[1]);
    // Without area it has no edge to be beyond of.
    if (!(glm::dot(normal, normal) > 0)) return nearest_around(point, at).triangle;
    // Beyond which edge is it farthest?
    std::uint32_t next = kNoIndex;
    double farthest = 0;
    for (std::uint32_t i = 0; i < 3; ++i) {
      const double beyond = glm::dot(glm::cross(point - t[i], sides[i]), normal);
      if (beyond <= 0) continue;
      const double square = beyond * beyond / glm::dot(sides[i], sides[i]);
      if (square <= farthest) continue;
      farthest = square;
      next = neighbour(at, i);
    }
    // Beyond the edge that it came over, too: that edge is near.
    if (next == kNoIndex || next == before) break;
    before = at;
    at = next;
  }
  return at;
}

template <class Index>
NearTriangle BasicLevelSurface<Index>::nearest_around(const glm::dvec3& point,
                                                      std::uint32_t start) const {
  NearTriangle best{distance_square(point, triangle(start)), start};
  // Vertices around which all triangles have been looked at.
  std::array<Index, 3 * kMostWalked> known;
  std::size_t count = 0;
  const auto is_known = [&](Index v) {
    return std::find(known.begin(), known.begin() + count, v) != known.begin() + count;
  };
  for (int steps = 0; steps < kMostWalked; ++steps) {
    const std::uint32_t at = best.triangle;
    for (const Index v : indices_.subspan(3 * std::size_t{at}, 3)) {
      if (begins_[v + std::size_t{1}] - begins_[v] > kWidestFan || is_known(v)) continue;
      for (std::uint32_t i = begins_[v]; i < begins_[v + std::size_t{1}]; ++i) {
        const std::uint32_t beside = corners_[i] / 3;
        if (beside == at || std::any_of(corners(beside), corners(beside) + 3, is_known)) continue;
        const double square = distance_square(point, triangle(beside), best.square);
        if (square < best.square) best = {square, beside};
      }
      known[count++] = v;
    }
    if (best.triangle == at) break;
  }
  return best;
}

template <class Index>
NearTriangle BasicLevelSurface<Index>::nearest(const glm::dvec3& point, double enough,
                                               const NearTriangle& near) {
  if (boxes_.empty()) make_boxes();
  NearTriangle found = near;
  if (looked_ > kMostLooked + kLookedATriangle * triangles()) {
    found.square = std::min(found.square, distance_square(point, triangle(found.triangle)));
    return found;
  }
  looked_ += boxes_.size();
  for (const Box& box : boxes_) {
    if (found.square <= enough) break;
    const glm::dvec3 off = glm::max(glm::max(box.low - point, point - box.high), glm::dvec3(0.0));
    if (glm::dot(off, off) >= found.square) continue;
    looked_ += box.end - box.first;
    for (std::uint32_t i = box.first; i < box.end; ++i) {
      const double square = distance_square(point, triangle(boxed_[i]), found.square);
      if (square < found.square) found = {square, boxed_[i]};
    }
  }
  return found;
}

template <class Index>
void BasicLevelSurface<Index>::make_boxes() {
  std::vector<glm::dvec3> centres;
  centres.reserve(triangles());
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high = -low;
  for (std::uint32_t t = 0; t < triangles(); ++t) {
    const std::array<glm::dvec3, 3> corners = triangle(t);
    centres.push_back((corners[0] + corners[1] + corners[2]) / 3.0);
    low = glm::min(low, centres[t]);
    high = glm::max(high, centres[t]);
  }
  // A surface goes through about the square of the cells along a side.
  const double cells = std::clamp(std::sqrt(triangles() / kBoxed), 1.0, kMostCells);
  const glm::dvec3 size = high - low;
  const double side = std::max({size.x, size.y, size.z}) / cells;
  const double per_length = side > 0 ? 1 / side : 0.0;
  const glm::uvec3 counts = glm::uvec3(size * per_length) + 1u;
  const auto cell_of = [&](std::uint32_t t) {
    const glm::uvec3 at((centres[t] - low) * per_length);
    return (std::size_t{at.z} * counts.y + at.y) * counts.x + at.x;
  };
  std::vector<std::uint32_t> ends(std::size_t{counts.x} * counts.y * counts.z + 1, 0);
  for (std::uint32_t t = 0; t < triangles(); ++t) ++ends[cell_of(t) + 1];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  boxed_.resize(triangles());
  for (std::uint32_t t = 0; t < triangles(); ++t) boxed_[ends[cell_of(t)]++] = t;
  std::uint32_t first = 0;
  for (const std::uint32_t end : ends) {
    if (end == first) continue;
    Box& box = boxes_.emplace_back();
    box.first = first;
    box.end = end;
    box.low = box.high = centres[boxed_[first]];
    for (; first < end; ++first) {
      for (const glm::dvec3& corner : triangle(boxed_[first])) {
        box.low = glm::min(box.low, corner);
        box.high = glm::max(box.high, corner);
      }
    }
  }
}

template class BasicLevelSurface<std::uint16_t>;
template class BasicLevelSurface<std::uint32_t>;

}  // namespace modar
