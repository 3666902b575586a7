// Ear clipping in the plane that fits the polygon best.
#include "bake/mesh/weld/triangulate.hpp"

#include <algorithm>
#include <cstddef>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace modar {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

/// Twice the area, positive where a, b, c turn left.
double turn(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Newell's normal: twice the area vector of a polygon that need not be planar.
glm::dvec3 newell_normal(std::span<const glm::dvec3> p) {
  glm::dvec3 n(0.0);
  for (std::size_t i = 0; i < p.size(); ++i) {
    // Relative to the first corner: georeferenced coordinates would drown the area otherwise.
    n += glm::cross(p[i] - p[0], p[(i + 1) % p.size()] - p[0]);
  }
  return n;
}

/// Drops the axis that the normal points along most; the remaining polygon turns left.
std::vector<glm::dvec2> flatten(std::span<const glm::dvec3> p, const glm::dvec3& normal) {
  const glm::dvec3 a = glm::abs(normal);
  const int drop = a.x > a.y && a.x > a.z ? 0 : (a.y > a.z ? 1 : 2);
  const int u = (drop + 1) % 3;
  const int v = (drop + 2) % 3;
  const double sign = normal[drop] < 0 ? -1.0 : 1.0;
  std::vector<glm::dvec2> flat;
  flat.reserve(p.size());
  for (const glm::dvec3& q : p) flat.emplace_back((q[u] - p[0][u]) * sign, q[v] - p[0][v]);
  return flat;
}

bool is_convex(const std::vector<glm::dvec2>& p) {
  const std::size_t n = p.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (turn(p[i], p[(i + 1) % n], p[(i + 2) % n]) < 0) return false;
  }
  // Every turn left and once round in all: a star winds twice and its fan from 0 turns right.
  for (std::size_t i = 1; i + 1 < n; ++i) {
    if (turn(p[0], p[i], p[i + 1]) < 0) return false;
  }
  return true;
}

/// The corners that are not cut off yet, as a ring.
struct Ring {
  std::vector<std::uint32_t> next;
  std::vector<std::uint32_t> previous;

  explicit Ring(std::size_t n) : next(n), previous(n) {
    for (std::size_t i = 0; i < n; ++i) {
      next[i] = static_cast<std::uint32_t>((i + 1) % n);
      previous[i] = static_cast<std::uint32_t>((i + n - 1) % n);
    }
  }
  void remove(std::uint32_t i) {
    next[previous[i]] = next[i];
    previous[next[i]] = previous[i];
  }
};

/// Is corner b an ear: convex, and no reflex corner of the rest inside a, b, c? Corners that share
/// a place with one of the three (bridges to holes) do not count.
bool is_ear(const std::vector<glm::dvec2>& p, const Ring& ring, std::uint32_t b) {
  const std::uint32_t a = ring.previous[b];
  const std::uint32_t c = ring.next[b];
  if (turn(p[a], p[b], p[c]) <= 0) return false;
  for (std::uint32_t i = ring.next[c]; i != a; i = ring.next[i]) {
    if (p[i] == p[a] || p[i] == p[b] || p[i] == p[c]) continue;
    if (turn(p[ring.previous[i]], p[i], p[ring.next[i]]) >= 0) continue;
    if (turn(p[a], p[b], p[i]) >= 0 && turn(p[b], p[c], p[i]) >= 0 && turn(p[c], p[a], p[i]) >= 0) {
      return false;
    }
  }
  return true;
}

bool clip_ears(const std::vector<glm::dvec2>& p, std::vector<Triangle>& out) {
  Ring ring(p.size());
  std::size_t left = p.size();
  std::uint32_t at = 1;
  std::size_t tried = 0;
  bool clean = true;
  while (left > 3) {
    const std::uint32_t a = ring.previous[at];
    const std::uint32_t c = ring.next[at];
    // A corner on a straight line makes a triangle without area; cutting it first would lose it as
    // a corner of its neighbour's, so it waits until nothing else is left.
    const bool flat = tried >= left && turn(p[a], p[at], p[c]) == 0;
    const bool forced = tried >= 2 * left;
    if (!flat && !forced && !is_ear(p, ring, at)) {
      at = c;
      ++tried;
      continue;
    }
    clean = clean && !forced;
    out.push_back({a, at, c});
    ring.remove(at);
    at = ring.next[c];
    --left;
    tried = 0;
  }
  out.push_back({ring.previous[at], at, ring.next[at]});
  return clean;
}

/// Corners of one round, where a polygon goes around several times.
std::size_t one_round(std::span<const glm::dvec3> p) {
  if (p.size() < 4 || std::find(p.begin() + 3, p.end(), p[0]) == p.end()) return p.size();
  // Of the polygon up to each corner, how many of its last corners are its first ones, too.
  std::vector<std::size_t> repeated(p.size());
  for (std::size_t i = 1; i < p.size(); ++i) {
    std::size_t count = repeated[i - 1];
    while (count > 0 && p[i] != p[count]) count = repeated[count - 1];
    repeated[i] = count + (p[i] == p[count] ? 1 : 0);
  }
  const std::size_t round = p.size() - repeated.back();
  return round < 3 ? p.size() : round;
}

}  // namespace

bool triangulate(std::span<const glm::dvec3> positions, std::vector<Triangle>& out) {
  positions = positions.first(one_round(positions));
  const auto n = static_cast<std::uint32_t>(positions.size());
  const auto fan = [&] {
    for (std::uint32_t i = 1; i + 1 < n; ++i) out.push_back({0, i, i + 1});
  };
  if (n == 3) {
    fan();
    return true;
  }
  const glm::dvec3 normal = newell_normal(positions);
  if (!(glm::dot(normal, normal) > 0)) {
    fan();
    return true;
  }
  const std::vector<glm::dvec2> flat = flatten(positions, normal);
  if (is_convex(flat)) {
    fan();
    return true;
  }
  if (n > kMaxEarCorners) {
    fan();
    return false;
  }
  return clip_ears(flat, out);
}

}  // namespace modar
