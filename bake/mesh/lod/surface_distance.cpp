// Subdivides triangles until each piece is known to lie within the bound.
#include "bake/mesh/lod/surface_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/import/source_model.hpp"

namespace modar {
namespace {

constexpr std::size_t next_corner(std::size_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

}  // namespace

LevelSurface::LevelSurface(std::span<const glm::dvec3> positions,
                           std::span<const std::uint16_t> indices)
    : positions_(positions), indices_(indices), neighbours_(indices.size(), kNoIndex) {
  // Corners by vertex: each stands for the edge that begins there.
  std::vector<std::uint32_t> begins(positions.size() + 1, 0);
  for (const std::uint16_t v : indices) ++begins[v + std::size_t{1}];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<std::uint32_t> corners(indices.size());
  std::vector<std::uint32_t> free(begins.begin(), begins.end() - 1);
  for (std::uint32_t c = 0; c < indices.size(); ++c) corners[free[indices[c]]++] = c;
  for (std::size_t c = 0; c < indices.size(); ++c) {
    const std::uint16_t to = indices[next_corner(c)];
    for (std::uint32_t i = begins[to]; i < begins[to + std::size_t{1}]; ++i) {
      if (indices[next_corner(corners[i])] != indices[c]) continue;
      neighbours_[c] = corners[i] / 3;
      break;
    }
  }
}

std::vector<std::uint32_t> LevelSurface::triangles_of_vertices() const {
  std::vector<std::uint32_t> result(positions_.size(), kNoIndex);
  for (std::size_t c = 0; c < indices_.size(); ++c) {
    result[indices_[c]] = static_cast<std::uint32_t>(c / 3);
  }
  return result;
}

TriangleTree& LevelSurface::tree() {
  if (!tree_) tree_ = std::make_unique<TriangleTree>(positions_, indices_);
  return *tree_;
}

const EdgePlanes& LevelSurface::planes(std::uint32_t t) {
  if (planes_.empty()) planes_.resize(indices_.size() / 3);
  EdgePlanes& planes = planes_[t];
  if (planes.known) return planes;
  planes.known = true;
  const std::array<glm::dvec3, 3> corners = triangle(t);
  const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double square = glm::dot(normal, normal);
  planes.has_area = square > 0;
  if (!planes.has_area) return planes;
  planes.normal = normal / std::sqrt(square);
  for (std::size_t i = 0; i < 3; ++i) {
    planes.outwards[i] = glm::normalize(glm::cross(corners[(i + 1) % 3] - corners[i], normal));
  }
  return planes;
}

namespace {

/// The bound may exceed a distance that was found by this factor: 1.5 keeps coarse levels usable at
/// their distance, and tighter bounds take more subdivisions.
constexpr double kSlack = 1.5;

/// Model space: narrower parts are not cut off. Far above double rounding, far below half floats.
constexpr double kSliver = 1e-9;
/// Pieces of one triangle; the rest is bounded as it is, less tightly. Set by hand against endless
/// subdivision, as kMostSteps.
constexpr std::size_t kMostPieces = 2000;
/// Pieces of one triangle that walk from neighbour to neighbour; the rest is searched in the tree.
constexpr std::size_t kMostSteps = 1500;

/// A convex piece of a triangle.
struct Piece {
  static constexpr std::size_t kMost = 8;
  std::array<glm::dvec3, kMost> corners;
  std::size_t count = 0;
  std::uint32_t target = kNoIndex;  ///< the triangle to try next, kNoIndex: search for one
  std::uint32_t before = kNoIndex;  ///< the one that it was cut off by

  /// Cutting a convex piece adds at most one corner; rounding may claim two.
  void add(const glm::dvec3& corner) {
    if (count < kMost) corners[count++] = corner;
  }
  [[nodiscard]] std::span<const glm::dvec3> all() const { return {corners.data(), count}; }
  [[nodiscard]] glm::dvec3 middle() const {
    glm::dvec3 sum(0.0);
    for (const glm::dvec3& corner : all()) sum += corner;
    return sum / static_cast<double>(count);
  }
};

/// Points closer than a sliver are on the plane: with rounding, a piece without area would cross it
/// again and again and gain a corner each time.
double off_plane(const glm::dvec3& p, const glm::dvec3& point, const glm::dvec3& normal) {
  const double off = glm::dot(p - point, normal);
  return std::abs(off) < kSliver ? 0.0 : off;
}

/// Is all of a piece behind a plane, or all of it before, but for slivers?
enum class Side : std::uint8_t { kBehind, kBefore, kBoth };
Side side_of(const Piece& piece, const glm::dvec3& point, const glm::dvec3& normal) {
  double low = 0;
  double high = 0;
  for (const glm::dvec3& corner : piece.all()) {
    const double off = glm::dot(corner - point, normal);
    low = std::min(low, off);
    high = std::max(high, off);
  }
  return high < kSliver ? Side::kBehind : low > -kSliver ? Side::kBefore : Side::kBoth;
}

/// The parts of a piece on either side of a plane through `point`, whose normal has unit length: at
/// most one corner more each.
void cut(const Piece& piece, const glm::dvec3& point, const glm::dvec3& normal, Piece& behind,
         Piece& before) {
  behind.count = before.count = 0;
  behind.target = before.target = kNoIndex;
  double low = 0;
  double high = 0;
  for (std::size_t i = 0; i < piece.count; ++i) {
    const glm::dvec3& a = piece.corners[i];
    const glm::dvec3& b = piece.corners[i + 1 == piece.count ? 0 : i + 1];
    const double at_a = off_plane(a, point, normal);
    const double at_b = off_plane(b, point, normal);
    low = std::min(low, at_a);
    high = std::max(high, at_a);
    if (at_a <= 0) behind.add(a);
    if (at_a >= 0) before.add(a);
    if ((at_a < 0 && at_b > 0) || (at_a > 0 && at_b < 0)) {
      const glm::dvec3 between = a + (b - a) * (at_a / (at_a - at_b));
      behind.add(between);
      before.add(between);
    }
  }
  // A sliver that only touches the plane is no part.
  if (low > -kSliver) behind.count = 0;
  if (high < kSliver) before.count = 0;
}

/// Sees points along the normal of a triangle: x and y in its plane, z the height over it.
class PlaneFrame {
 public:
  /// normal: of unit length.
  PlaneFrame(const std::array<glm::dvec3, 3>& t, const glm::dvec3& normal)
      : origin_(t[0]), x_(glm::normalize(t[1] - t[0])), y_(glm::cross(normal, x_)), z_(normal) {
    for (std::size_t i = 0; i < 3; ++i) corners_[i] = seen(t[i]);
    low_ = glm::min(glm::min(corners_[0], corners_[1]), corners_[2]);
    high_ = glm::max(glm::max(corners_[0], corners_[1]), corners_[2]);
  }

  [[nodiscard]] glm::dvec3 seen(const glm::dvec3& p) const {
    const glm::dvec3 d = p - origin_;
    return {glm::dot(d, x_), glm::dot(d, y_), glm::dot(d, z_)};
  }

  /// Does a triangle, as seen, meet the inside of this one? Touching it by less than a sliver is no
  /// meeting (separating axes).
  [[nodiscard]] bool meets(const std::array<glm::dvec3, 3>& t) const {
    for (int i = 0; i < 2; ++i) {
      if (std::max({t[0][i], t[1][i], t[2][i]}) <= low_[i]) return false;
      if (std::min({t[0][i], t[1][i], t[2][i]}) >= high_[i]) return false;
    }
    return !parted(corners_, t) && !parted(t, corners_);
  }

  /// Does the line between two points, as seen, meet the inside?
  [[nodiscard]] bool crosses(const glm::dvec3& a, const glm::dvec3& b) const {
    return !parted(corners_, std::array<glm::dvec3, 3>{a, b, b}) && !beside(a, b, corners_) &&
           !beside(b, a, corners_);
  }

 private:
  /// Are all points right of the line from a to b, but for slivers?
  static bool beside(const glm::dvec3& a, const glm::dvec3& b,
                     const std::array<glm::dvec3, 3>& points) {
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    const double slack = kSliver * (std::abs(dx) + std::abs(dy));
    for (const glm::dvec3& p : points) {
      if (dx * (p.y - a.y) - dy * (p.x - a.x) > slack) return false;
    }
    return true;
  }
  /// Is there an edge of `from`, which turns left or right, with all of `from` on one side and all
  /// points on the other?
  static bool parted(const std::array<glm::dvec3, 3>& from,
                     const std::array<glm::dvec3, 3>& points) {
    const double area = (from[1].x - from[0].x) * (from[2].y - from[0].y) -
                        (from[1].y - from[0].y) * (from[2].x - from[0].x);
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::dvec3& a = from[i];
      const glm::dvec3& b = from[(i + 1) % 3];
      if (area >= 0 ? beside(a, b, points) : beside(b, a, points)) return true;
    }
    return false;
  }

  glm::dvec3 origin_;
  glm::dvec3 x_;
  glm::dvec3 y_;
  glm::dvec3 z_;
  std::array<glm::dvec3, 3> corners_{};
  glm::dvec3 low_;
  glm::dvec3 high_;
};

class Bounder {
 public:
  Bounder(LevelSurface& to, double least)
      : to_(to), limit_(std::max(kDistanceFloor, least)), bound_(least) {}

  /// Finds the distance of the farthest of some points, whose squared distances are at most these.
  void probe(std::vector<std::pair<double, std::uint16_t>> points) {
    std::make_heap(points.begin(), points.end());
    while (!points.empty() && points.front().first > std::max(lower_ * lower_, limit_square())) {
      const glm::dvec3& point = to_.position(points.front().second);
      raise_lower(std::sqrt(to_.tree().nearest(point, lower_ * lower_)));
      std::pop_heap(points.begin(), points.end());
      points.pop_back();
    }
  }

  /// Raises the bound to hold for every point of the triangle; starts at one of `nearby`.
  void cover(Piece whole, const std::array<std::uint32_t, 3>& nearby) {
    for (const std::uint32_t near : nearby) {
      if (whole.target == kNoIndex) whole.target = near;
    }
    pieces_.assign(1, whole);
    std::size_t pieces = 0;
    while (!pieces_.empty()) {
      const Piece piece = pieces_.back();
      pieces_.pop_back();
      if (piece.target != kNoIndex && pieces < kMostSteps) {
        ++pieces;
        step(piece);
      } else if (!accept(piece, ++pieces > kMostPieces)) {
        divide(piece);
      }
    }
  }

  /// Raises the bound to hold for the triangle, where the other surface is a graph over it: seen
  /// along the triangle's normal, those of its triangles that meet this one all look the same way
  /// and end outside of it. Then (by the degree of the projection) they cover it, and no point of
  /// it lies farther from them than they do. start: a triangle of the other surface that shares a
  /// vertex with this one, `shared`. False, with nothing done, where it is no such graph or too far
  /// off.
  bool cover_by_graph(const std::array<glm::dvec3, 3>& t, std::uint32_t start,
                      std::uint16_t shared) {
    const glm::dvec3 across = glm::cross(t[1] - t[0], t[2] - t[0]);
    const double square = glm::dot(across, across);
    if (start == kNoIndex || !(square > 0)) return false;
    const PlaneFrame frame(t, across / std::sqrt(square));
    seen_.resize(to_.indices().size() / 3, 0);
    ++stamp_;
    waiting_.assign(1, start);
    seen_[start] = stamp_;
    double greatest = 0;
    bool met = false;
    while (!waiting_.empty()) {
      const std::uint32_t at = waiting_.back();
      waiting_.pop_back();
      std::array<glm::dvec3, 3> seen;
      for (std::size_t i = 0; i < 3; ++i) seen[i] = frame.seen(to_.triangle(at)[i]);
      const bool meets = frame.meets(seen);
      if (meets) {
        met = true;
        const double area = (seen[1].x - seen[0].x) * (seen[2].y - seen[0].y) -
                            (seen[1].y - seen[0].y) * (seen[2].x - seen[0].x);
        if (!(area > 0)) return false;
        for (const glm::dvec3& corner : seen) greatest = std::max(greatest, std::abs(corner.z));
        if (greatest > limit()) return false;
      }
      const std::uint16_t* v = &to_.indices()[3 * std::size_t{at}];
      for (std::size_t i = 0; i < 3; ++i) {
        const bool at_shared = v[i] == shared || v[(i + 1) % 3] == shared;
        if (!meets && !at_shared) continue;
        const std::uint32_t next = to_.neighbour(at, i);
        if (next == kNoIndex) {
          if (meets && frame.crosses(seen[i], seen[(i + 1) % 3])) return false;
        } else if (seen_[next] != stamp_) {
          seen_[next] = stamp_;
          waiting_.push_back(next);
        }
      }
    }
    if (!met) return false;
    bound_ = std::max(bound_, greatest);
    return true;
  }

  [[nodiscard]] double bound() const { return bound_; }

 private:
  /// Is the piece near enough to one triangle? The distance from it is convex, so its corners bound
  /// the piece.
  bool accept_by(const Piece& piece, const std::array<glm::dvec3, 3>& t) {
    double greatest = 0;
    const double most = limit_square();
    for (const glm::dvec3& corner : piece.all()) {
      greatest = std::max(greatest, distance_square(corner, t));
      if (greatest > most) return false;
    }
    bound_ = std::max(bound_, std::sqrt(greatest));
    return true;
  }

  /// Cuts off what lies beyond the edges of the piece's target and hands it to the neighbours
  /// there. What is left lies over the target: its distance is that from the target's plane.
  void step(Piece piece) {
    const std::uint32_t target = piece.target;
    const EdgePlanes& planes = to_.planes(target);
    const std::uint32_t came_from = std::exchange(piece.before, target);
    piece.target = kNoIndex;
    if (!planes.has_area) {
      pieces_.push_back(piece);
      return;
    }
    const std::array<glm::dvec3, 3> t = to_.triangle(target);
    for (std::size_t i = 0; i < 3 && piece.count < Piece::kMost; ++i) {
      const Side side = side_of(piece, t[i], planes.outwards[i]);
      if (side == Side::kBehind) continue;
      if (side == Side::kBefore) return hand_over(piece, target, i, came_from);
      Piece outside;
      Piece inside;
      cut(piece, t[i], planes.outwards[i], inside, outside);
      outside.before = target;
      if (outside.count >= 3) hand_over(outside, target, i, came_from);
      if (inside.count < 3) return;
      piece.corners = inside.corners;
      piece.count = inside.count;
    }
    double greatest = 0;
    for (const glm::dvec3& corner : piece.all()) {
      greatest = std::max(greatest, std::abs(glm::dot(corner - t[0], planes.normal)));
    }
    greatest += 2 * kSliver;  // corners may lie so far outside of the prism
    if (piece.count < Piece::kMost && greatest <= limit()) {
      bound_ = std::max(bound_, greatest);
    } else if (!accept_by(piece, t)) {
      pieces_.push_back(piece);
    }
  }

  /// Sends a piece that lies beyond edge i of a triangle to the neighbour there.
  void hand_over(Piece& piece, std::uint32_t from, std::size_t i, std::uint32_t came_from) {
    piece.target = to_.neighbour(from, i);
    // Over an edge between two triangles, a piece may lie outside of both: it is nearest to the
    // edge.
    if (piece.target == came_from) piece.target = kNoIndex;
    if (piece.target != kNoIndex || !accept_by(piece, to_.triangle(from))) pieces_.push_back(piece);
  }

  bool accept(const Piece& piece, bool at_once) {
    TriangleTree& tree = to_.tree();
    const glm::dvec3 middle = piece.middle();
    double radius = 0;
    for (const glm::dvec3& corner : piece.all()) {
      radius = std::max(radius, glm::length(corner - middle));
    }
    const double margin = std::max(0.0, limit() - radius);
    const double distance = std::sqrt(tree.nearest(middle, margin * margin));
    // A triangle found within the margin need not be the nearest: it proves no distance.
    if (distance > margin) raise_lower(distance);
    // Within the radius no point is farther off than so.
    const double upper = std::min(distance + radius, corner_bound(piece));
    if (upper > limit() && !at_once) return false;
    bound_ = std::max(bound_, upper);
    return true;
  }

  [[nodiscard]] double corner_bound(const Piece& piece) {
    double greatest = 0;
    for (const glm::dvec3& corner : piece.all()) {
      greatest = std::max(greatest, distance_square(corner, to_.tree().last()));
    }
    return std::sqrt(greatest);
  }

  /// Separates the part over the nearest triangle, which is mostly settled then, from the parts
  /// beside it.
  void divide(Piece piece) {
    const std::array<glm::dvec3, 3> t = to_.tree().last();
    const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    if (!(glm::dot(normal, normal) > 0)) return halve(piece);
    Piece outside;
    Piece inside;
    bool parted = false;
    for (std::size_t i = 0; i < 3; ++i) {
      if (piece.count + 1 > Piece::kMost) break;
      cut(piece, t[i], glm::normalize(glm::cross(t[(i + 1) % 3] - t[i], normal)), inside, outside);
      if (inside.count < 3) {
        halve(piece);
        return;
      }
      if (outside.count < 3) continue;
      parted = true;
      pieces_.push_back(outside);
      piece = inside;
    }
    if (!parted) {
      halve(piece);
    } else if (const double upper = corner_bound(piece); upper <= limit()) {
      bound_ = std::max(bound_, upper);
    } else {
      pieces_.push_back(piece);
    }
  }

  /// Across the line from its middle to the farthest corner.
  void halve(const Piece& piece) {
    const glm::dvec3 middle = piece.middle();
    glm::dvec3 far = piece.corners[0];
    for (const glm::dvec3& corner : piece.all()) {
      if (glm::length(corner - middle) > glm::length(far - middle)) far = corner;
    }
    if (piece.count == Piece::kMost) {
      // No space for another corner: split the piece into triangles.
      for (std::size_t i = 1; i + 1 < piece.count; ++i) {
        Piece& part = pieces_.emplace_back();
        for (const std::size_t c : {std::size_t{0}, i, i + 1}) part.add(piece.corners[c]);
      }
      return;
    }
    Piece near_part;
    Piece far_part;
    cut(piece, middle, glm::normalize(far - middle), near_part, far_part);
    for (const Piece& part : {near_part, far_part}) {
      if (part.count >= 3) pieces_.push_back(part);
    }
  }

  void raise_lower(double distance) {
    lower_ = std::max(lower_, distance);
    limit_ = std::max(limit_, kSlack * lower_);
  }
  [[nodiscard]] double limit() const { return limit_; }
  [[nodiscard]] double limit_square() const { return limit_ * limit_; }

  LevelSurface& to_;
  double lower_ = 0;  ///< a distance that was found
  double limit_;      ///< pieces within it need no closer look
  double bound_;
  std::vector<Piece> pieces_;
  std::vector<std::uint32_t> seen_;  ///< stamp_ where a triangle was, in cover_by_graph()
  std::uint32_t stamp_ = 0;
  std::vector<std::uint32_t> waiting_;
};

/// A triangle from its lowest corner on, as one number.
std::uint64_t key_of(const std::uint16_t* t) {
  std::array<std::uint64_t, 3> v = {t[0], t[1], t[2]};
  std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
  return v[0] << 32 | v[1] << 16 | v[2];
}

/// Triangles of `from` that `to` does not have.
std::vector<std::size_t> changed(std::span<const std::uint16_t> from,
                                 std::span<const std::uint16_t> to) {
  std::vector<std::uint64_t> kept;
  kept.reserve(to.size() / 3);
  for (std::size_t i = 0; i < to.size(); i += 3) kept.push_back(key_of(&to[i]));
  std::sort(kept.begin(), kept.end());
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < from.size(); i += 3) {
    if (!std::binary_search(kept.begin(), kept.end(), key_of(&from[i]))) result.push_back(i);
  }
  return result;
}

}  // namespace

double surface_distance(const LevelSurface& from, LevelSurface& to,
                        std::span<const std::uint32_t> nearby, double least) {
  Bounder bounder(to, least);
  const std::span<const std::uint16_t> corners = from.indices();
  const std::vector<std::size_t> triangles = changed(corners, to.indices());
  std::vector<std::pair<double, std::uint16_t>> probes;
  std::vector<bool> probed(nearby.size(), false);
  for (const std::size_t i : triangles) {
    for (std::size_t k = i; k < i + 3; ++k) {
      const std::uint16_t v = corners[k];
      if (nearby[v] == kNoIndex || probed[v]) continue;
      probed[v] = true;
      probes.emplace_back(distance_square(from.position(v), to.triangle(nearby[v])), v);
    }
  }
  bounder.probe(std::move(probes));
  for (const std::size_t i : triangles) {
    const std::array<glm::dvec3, 3> corner = from.triangle(static_cast<std::uint32_t>(i / 3));
    const std::array<std::uint32_t, 3> near = {nearby[corners[i]], nearby[corners[i + 1]],
                                               nearby[corners[i + 2]]};
    if (bounder.cover_by_graph(corner, near[0], corners[i])) continue;
    Piece whole;
    for (const glm::dvec3& c : corner) whole.add(c);
    bounder.cover(whole, near);
  }
  return bounder.bound();
}

}  // namespace modar
