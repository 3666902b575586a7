// Ear clipping in the plane that fits the polygon best.
#include "bake/mesh/weld/triangulate.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <set>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

namespace modar {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr std::uint32_t kNobody = 0xFFFFFFFF;
constexpr std::uint64_t kMostVisits = 4096;  // boxes a corner; beyond, the rest becomes a fan

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

bool within(const std::vector<glm::dvec2>& p, const Triangle& t, const glm::dvec2& q) {
  return turn(p[t[0]], p[t[1]], q) >= 0 && turn(p[t[1]], p[t[2]], q) >= 0 &&
         turn(p[t[2]], p[t[0]], q) >= 0;
}

/// Finds reflex corners in a triangle. A tree of boxes, each with the number of its reflex corners.
class ReflexTree {
 public:
  explicit ReflexTree(const std::vector<glm::dvec2>& p) : p_(p), order_(p.size()), at_(p.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    split(0, 0, order_.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) at_[order_[i]] = i;
    reflex_.resize(p.size());
  }

  void set(std::uint32_t corner, bool reflex) {
    if ((reflex_[corner] != 0) == reflex) return;
    reflex_[corner] = reflex ? 1 : 0;
    std::size_t begin = 0;
    std::size_t end = order_.size();
    for (std::size_t node = 0;;) {
      boxes_[node].reflex += reflex ? 1 : -1;
      if (end - begin <= kLeaf) return;
      const std::size_t middle = (begin + end) / 2;
      const bool right = at_[corner] >= middle;
      (right ? begin : end) = middle;
      node = 2 * node + (right ? 2 : 1);
    }
  }

  /// One of them, or kNobody. Corners that share a place with one of the three (bridges to holes)
  /// do not count.
  std::uint32_t find_in(const Triangle& t) { return find_in(t, 0, 0, order_.size()); }

  [[nodiscard]] std::uint64_t visits() const { return visits_; }

 private:
  static constexpr std::size_t kLeaf = 16;
  struct Box {
    glm::dvec2 low;
    glm::dvec2 high;
    std::int64_t reflex = 0;
  };

  void split(std::size_t node, std::size_t begin, std::size_t end) {
    if (boxes_.size() <= node) boxes_.resize(node + 1);
    Box box{p_[order_[begin]], p_[order_[begin]]};
    for (std::size_t i = begin; i < end; ++i) {
      box.low = glm::min(box.low, p_[order_[i]]);
      box.high = glm::max(box.high, p_[order_[i]]);
    }
    boxes_[node] = box;
    if (end - begin <= kLeaf) return;
    const int axis = box.high.x - box.low.x > box.high.y - box.low.y ? 0 : 1;
    const std::size_t middle = (begin + end) / 2;
    const auto place = [&](std::size_t i) {
      return order_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(place(begin), place(middle), place(end),
                     [&](auto a, auto b) { return p_[a][axis] < p_[b][axis]; });
    split(2 * node + 1, begin, middle);
    split(2 * node + 2, middle, end);
  }

  /// Whether a box is on the outer side of an edge.
  static bool outside(const Box& box, const glm::dvec2& a, const glm::dvec2& b) {
    const glm::dvec2 nearest(b.y > a.y ? box.low.x : box.high.x,
                             b.x > a.x ? box.high.y : box.low.y);
    return turn(a, b, nearest) < 0;
  }

  std::uint32_t find_in(const Triangle& t, std::size_t node, std::size_t begin, std::size_t end) {
    const Box& box = boxes_[node];
    ++visits_;
    if (box.reflex == 0 || outside(box, p_[t[0]], p_[t[1]]) || outside(box, p_[t[1]], p_[t[2]]) ||
        outside(box, p_[t[2]], p_[t[0]])) {
      return kNobody;
    }
    if (end - begin > kLeaf) {
      const std::size_t middle = (begin + end) / 2;
      const std::uint32_t found = find_in(t, 2 * node + 1, begin, middle);
      return found != kNobody ? found : find_in(t, 2 * node + 2, middle, end);
    }
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec2& q = p_[order_[i]];
      const bool shared = q == p_[t[0]] || q == p_[t[1]] || q == p_[t[2]];
      if (reflex_[order_[i]] != 0 && !shared && within(p_, t, q)) return order_[i];
    }
    return kNobody;
  }

  const std::vector<glm::dvec2>& p_;
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> at_;  ///< of a corner in order_
  std::vector<Box> boxes_;
  std::vector<std::uint8_t> reflex_;
  std::uint64_t visits_ = 0;
};

/// Cuts ears off, round after round: convex corners whose triangle has no reflex corner in it.
class EarClipper {
 public:
  explicit EarClipper(const std::vector<glm::dvec2>& p)
      : p_(p), ring_(p.size()), reflex_(p), blocked_(p.size()) {}

  bool run(std::vector<Triangle>& out) {
    const auto n = static_cast<std::uint32_t>(p_.size());
    for (std::uint32_t i = 0; i < n; ++i) reflex_.set(i, turn_at(i) < 0);
    for (std::uint32_t i = 0; i < n; ++i) judge(i);
    bool clean = true;
    std::uint32_t at = 1;
    for (std::size_t left = n; left > 3;) {
      // A corner on a straight line makes a triangle without area; cutting it first would lose it
      // as a corner of its neighbour's, so it waits until nothing else is left.
      const std::set<std::uint32_t>& ready = ears_.empty() ? flat_ : ears_;
      if (ready.empty()) {
        clean = false;
      } else {
        const auto following = ready.lower_bound(at);
        const std::uint32_t next = following == ready.end() ? *ready.begin() : *following;
        // Where a polygon is tangled, corners become reflex.
        if (!ears_.empty() && !judge(next)) continue;
        at = next;
      }
      at = cut(at, out);
      --left;
    }
    out.push_back({ring_.previous[at], at, ring_.next[at]});
    return clean;
  }

 private:
  [[nodiscard]] double turn_at(std::uint32_t i) const {
    return turn(p_[ring_.previous[i]], p_[i], p_[ring_.next[i]]);
  }

  /// Is it an ear?
  bool judge(std::uint32_t i) {
    ears_.erase(i);
    flat_.erase(i);
    const double bend = turn_at(i);
    if (bend == 0) flat_.insert(i);
    if (bend <= 0 || reflex_.visits() > kMostVisits * p_.size()) return false;
    const std::uint32_t in_it = reflex_.find_in({ring_.previous[i], i, ring_.next[i]});
    if (in_it == kNobody) return ears_.insert(i).second;
    blocked_[in_it].push_back(i);
    return false;
  }

  /// Judges those that it was in the way of, where it is reflex no more: as a rule another corner
  /// is, and they wait for their neighbours to change.
  void see(std::uint32_t i, bool reflex) {
    reflex_.set(i, reflex);
    if (reflex || reflex_.visits() > kMostVisits / 16 * p_.size()) return;
    for (const std::uint32_t corner : std::exchange(blocked_[i], {})) {
      if (ring_.next[ring_.previous[corner]] == corner) judge(corner);
    }
  }

  /// Returns the corner from which the next one is looked for.
  std::uint32_t cut(std::uint32_t i, std::vector<Triangle>& out) {
    const std::uint32_t a = ring_.previous[i];
    const std::uint32_t c = ring_.next[i];
    out.push_back({a, i, c});
    ears_.erase(i);
    flat_.erase(i);
    ring_.remove(i);
    for (const std::uint32_t corner : {a, c}) reflex_.set(corner, turn_at(corner) < 0);
    see(i, false);
    for (const std::uint32_t corner : {a, c}) see(corner, turn_at(corner) < 0);
    for (const std::uint32_t corner : {a, c}) judge(corner);
    return ring_.next[c];
  }

  const std::vector<glm::dvec2>& p_;
  Ring ring_;
  ReflexTree reflex_;
  std::vector<std::vector<std::uint32_t>> blocked_;  ///< by the reflex corner in their triangle
  std::set<std::uint32_t> ears_;
  std::set<std::uint32_t> flat_;
};

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
  return EarClipper(flat).run(out);
}

}  // namespace modar
