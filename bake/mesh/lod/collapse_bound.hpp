// What collapses alone tell of the distance between two levels. Internal to lod.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace modar {

/// Share of the shading's error below which distances of large models need no exact measure. Higher
/// bakes faster and states the distance less exactly. [0.25, 1]
inline constexpr double kHidden = 1;

/// Which parts of two levels are near each other, as far as the way of each vertex tells.
struct CollapseBound {
  double moved = 0;  ///< bounds the distance of the settled part from the other level
  /// 1 for each triangle of the finer level that is within the limit of the coarser one.
  std::vector<std::uint8_t> settled;
  std::vector<std::uint32_t> open;  ///< the triangles of the finer level that are not settled
};

/// Collapses map a level onto the coarser one: a triangle onto one of its triangles, edges or
/// vertices, so that no point of either is farther from the other's than corners are from what they
/// have become. moved: of each vertex, the square of that distance, infinite where it has become no
/// part of the coarser level. fine: triangles of the finer one. lands: is what a triangle of the
/// finer level has become part of the coarser? Where it is not, the triangle's points are within
/// the longest side over the root of three of some corner. most: the limit.
template <class Index, class Lands>
CollapseBound collapse_bound(std::span<const glm::dvec3> positions, std::span<const Index> fine,
                             std::span<const double> moved, const Lands& lands, double most) {
  CollapseBound bound;
  bound.settled.assign(fine.size() / 3, 1);
  double greatest = 0;  // square
  for (std::uint32_t t = 0; t < bound.settled.size(); ++t) {
    const Index* v = &fine[3 * std::size_t{t}];
    double square = std::max({moved[v[0]], moved[v[1]], moved[v[2]]});
    if (square <= most * most && !lands(t)) {
      double longest = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec3 side = positions[v[(k + 1) % 3]] - positions[v[k]];
        longest = std::max(longest, glm::dot(side, side));
      }
      const double sum = std::sqrt(square) + std::sqrt(longest / 3);
      square = sum * sum;
    }
    if (square <= most * most) {
      greatest = std::max(greatest, square);
    } else {
      bound.settled[t] = 0;
      bound.open.push_back(t);
    }
  }
  bound.moved = std::sqrt(greatest);
  return bound;
}

}  // namespace modar
