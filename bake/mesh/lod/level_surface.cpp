// Corners sorted by vertex, and walks over the triangles.
#include "bake/mesh/lod/level_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace modar {
namespace {

/// Triangles of a box where they are searched for the nearest, on average, and boxes along the
/// longest side: a search looks at all boxes, and at the triangles of a few. Swept on scans: the
/// same time from 8 to 32, and from 24 to 96.
constexpr double kBoxed = 16;
constexpr double kMostCells = 48;
/// Steps of a walk; what needs more is answered by where it has got to. Three levels off, a walk
/// takes about five. Swept on scans: flat from 12 to 48.
constexpr int kMostWalked = 24;
/// Triangles around a vertex that a search looks at. Where a coarse level has few vertices between
/// a chunk's borders, which stay, hundreds of triangles meet in one, and each vertex of the finest
/// level would look at all of them; a tree finds the nearest then: a rough grid of 14.6 million
/// triangles took 269 CPU-s before this and `seen`, 154 after (loaded machine). Swept on scans:
/// flat from 16 to 64.
constexpr std::uint32_t kWidestFan = 32;

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
    for (std::uint32_t i = begins_[v]; i < begins_[v + 1]; ++i) {
      if (ends_[i] < v) continue;
      const std::uint32_t back = edge(ends_[i], static_cast<Index>(v));
      if (back == kNoIndex || edge(static_cast<Index>(v), ends_[i]) == kNoIndex) continue;
      opposites_[corners_[i]] = back;
      opposites_[back] = corners_[i];
    }
  }
}

template <class Index>
std::uint32_t BasicLevelSurface<Index>::edge(Index from, Index to) const {
  std::uint32_t found = kNoIndex;
  for (std::uint32_t i = begins_[from]; i < begins_[from + std::size_t{1}]; ++i) {
    if (ends_[i] != to) continue;
    if (found != kNoIndex) return kNoIndex;
    found = corners_[i];
  }
  return found;
}

template <class Index>
bool BasicLevelSurface<Index>::has_edge(Index from, Index to) const {
  const auto begin = ends_.begin() + begins_[from];
  const auto end = ends_.begin() + begins_[from + std::size_t{1}];
  return std::find(begin, end, to) != end;
}

template <class Index>
std::uint32_t BasicLevelSurface<Index>::find(Index a, Index b, Index c) const {
  for (std::uint32_t i = begins_[a]; i < begins_[a + std::size_t{1}]; ++i) {
    if (ends_[i] != b) continue;
    if (indices_[next_corner(next_corner(corners_[i]))] == c) return corners_[i] / 3;
  }
  return kNoIndex;
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
  for (const Box& box : boxes_) {
    if (found.square <= enough) break;
    const glm::dvec3 off = glm::max(glm::max(box.low - point, point - box.high), glm::dvec3(0.0));
    if (glm::dot(off, off) >= found.square) continue;
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
