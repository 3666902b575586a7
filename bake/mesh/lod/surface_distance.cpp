// Subdivides triangles until each piece is known to be within the bound.
#include "bake/mesh/lod/surface_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Factor of the found distance within which a triangle's corners alone decide. Higher is faster
/// and loosens the bound. [1.05, 1.4] tuned: lod
constexpr double kQuick = 1.15;

/// How often a triangle is quartered before it is cut along those of the other surface. Swept on
/// scans: flat from 1 to 5.
constexpr int kQuartered = 3;

/// Model space: narrower parts are not cut off. Far above double rounding, far below half floats.
constexpr double kSliver = 1e-9;
/// Pieces of one triangle; the rest is bounded without, less tightly. Against endless subdivision,
/// as kMostSteps. Swept on scans: flat from 500 to 8,000.
constexpr std::size_t kMostPieces = 2000;
/// Pieces of all triangles, for each; the rest is then bounded by any triangle near it. Scans
/// and models need up to 150.
constexpr std::size_t kPieces = 400;
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
  behind.before = before.before = piece.before;
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

/// Some corner of a triangle is as near to each of its points: the radius of its circle, or half of
/// its longest side where it has no acute angle opposite.
double corner_reach(const std::array<glm::dvec3, 3>& t) {
  const glm::dvec3 ab = t[1] - t[0];
  const glm::dvec3 ac = t[2] - t[0];
  const glm::dvec3 bc = t[2] - t[1];
  std::array<double, 3> squares = {glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(bc, bc)};
  std::sort(squares.begin(), squares.end());
  if (squares[0] + squares[1] <= squares[2]) return 0.5 * std::sqrt(squares[2]);
  const glm::dvec3 across = glm::cross(ab, ac);
  return 0.5 * std::sqrt(squares[0] * squares[1] * squares[2] / glm::dot(across, across));
}

template <class Index>
class Bounder {
 public:
  Bounder(BasicLevelSurface<Index>& to, double least, double found, std::size_t pieces)
      : to_(to), limit_(std::max(kDistanceFloor, least)), bound_(least), pieces_left_(pieces) {
    raise_lower(found);
  }

  /// Finds the distance of the farthest of some points, whose squared distances are at most these:
  /// from the triangles in `nearby`.
  void probe(const BasicLevelSurface<Index>& from, std::vector<std::pair<double, Index>> points,
             std::span<const std::uint32_t> nearby) {
    std::make_heap(points.begin(), points.end());
    while (!points.empty() && points.front().first > std::max(lower_ * lower_, limit_square())) {
      const auto [square, v] = points.front();
      const NearTriangle near = {square, nearby[v]};
      raise_lower(std::sqrt(to_.nearest(from.position(v), lower_ * lower_, near).square));
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
    settle();
  }

  /// Raises the bound to hold for a triangle, where its corners tell enough. squares: of their
  /// distances from the triangles in `nearby` (kNoIndex: unknown).
  bool cover_by_corners(const std::array<glm::dvec3, 3>& t,
                        const std::array<std::uint32_t, 3>& nearby,
                        const std::array<double, 3>& squares) {
    if (std::find(nearby.begin(), nearby.end(), kNoIndex) != nearby.end()) return false;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 3; ++i) {
      // The distance from one triangle is convex.
      if (i > 0 && nearby[i] == nearby[i - 1]) continue;
      double greatest = squares[i];
      for (const std::size_t k : {(i + 1) % 3, (i + 2) % 3}) {
        if (greatest >= least) break;
        greatest = std::max(greatest, nearby[k] == nearby[i]
                                          ? squares[k]
                                          : distance_square(t[k], to_.triangle(nearby[i])));
      }
      least = std::min(least, greatest);
      if (least <= bound_ * bound_) return true;
    }
    double distance = std::sqrt(least);
    if (distance > quick_limit()) {
      distance = std::sqrt(std::max({squares[0], squares[1], squares[2]})) + corner_reach(t);
    }
    if (distance > quick_limit()) return false;
    bound_ = std::max(bound_, distance);
    return true;
  }

  /// Raises the bound to hold for a triangle that may be larger than those of the other surface,
  /// where quarters of it, and of these, are each near enough to one triangle: the distance from it
  /// is convex, so corners tell. The smallest are cut along the other surface. near: a triangle
  /// that is probably near.
  void cover_by_quarters(const std::array<glm::dvec3, 3>& t, std::uint32_t near, int depth = 0) {
    const std::uint32_t at = to_.walk((t[0] + t[1] + t[2]) / 3.0, near);
    const std::array<glm::dvec3, 3> other = to_.triangle(at);
    const double most = quick_limit() * quick_limit();
    double square = 0;
    for (std::size_t i = 0; i < 3 && square <= most; ++i) {
      square = std::max(square, distance_square(t[i], other));
    }
    if (square <= most) {
      bound_ = std::max(bound_, std::sqrt(square));
      return;
    }
    if (depth == kQuartered) {
      Piece whole;
      for (const glm::dvec3& corner : t) whole.add(corner);
      return cover(whole, {at, kNoIndex, kNoIndex});
    }
    const std::array<glm::dvec3, 3> m = {0.5 * (t[0] + t[1]), 0.5 * (t[1] + t[2]),
                                         0.5 * (t[2] + t[0])};
    cover_by_quarters(m, at, depth + 1);
    cover_by_quarters({t[0], m[0], m[2]}, at, depth + 1);
    cover_by_quarters({m[0], t[1], m[1]}, at, depth + 1);
    cover_by_quarters({m[2], m[1], t[2]}, at, depth + 1);
  }

  [[nodiscard]] double bound() const { return bound_; }

 private:
  /// Raises the bound to hold for all pieces that wait.
  void settle() {
    std::size_t pieces = 0;
    while (!pieces_.empty()) {
      const Piece piece = pieces_.back();
      pieces_.pop_back();
      if (pieces_left_ == 0) {
        nearest_ = std::min({piece.target, piece.before, to_.triangles() - 1});
        bound_ = std::max(bound_, corner_bound(piece));
        continue;
      }
      --pieces_left_;
      if (piece.target != kNoIndex && pieces < kMostSteps) {
        ++pieces;
        step(piece);
      } else if (!accept(piece, ++pieces > kMostPieces)) {
        divide(piece);
      }
    }
  }

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

  /// Cuts off the parts beyond the edges of the piece's target and hands it to the neighbours
  /// there. The rest is over the target: its distance is that from the target's plane.
  void step(Piece piece) {
    const std::uint32_t target = piece.target;
    const std::uint32_t came_from = std::exchange(piece.before, target);
    piece.target = kNoIndex;
    const std::array<glm::dvec3, 3> t = to_.triangle(target);
    const glm::dvec3 across = glm::cross(t[1] - t[0], t[2] - t[0]);
    if (!(glm::dot(across, across) > 0)) {
      pieces_.push_back(piece);
      return;
    }
    const glm::dvec3 normal = glm::normalize(across);
    for (std::uint32_t i = 0; i < 3 && piece.count < Piece::kMost; ++i) {
      const glm::dvec3 outwards = glm::normalize(glm::cross(t[(i + 1) % 3] - t[i], normal));
      const Side side = side_of(piece, t[i], outwards);
      if (side == Side::kBehind) continue;
      if (side == Side::kBefore) return hand_over(piece, target, i, came_from);
      Piece outside;
      Piece inside;
      cut(piece, t[i], outwards, inside, outside);
      outside.before = target;
      if (outside.count >= 3) hand_over(outside, target, i, came_from);
      if (inside.count < 3) return;
      piece.corners = inside.corners;
      piece.count = inside.count;
    }
    double greatest = 0;
    for (const glm::dvec3& corner : piece.all()) {
      greatest = std::max(greatest, std::abs(glm::dot(corner - t[0], normal)));
    }
    greatest += 2 * kSliver;  // corners may be so far outside of the prism
    if (piece.count < Piece::kMost && greatest <= limit()) {
      bound_ = std::max(bound_, greatest);
    } else if (!accept_by(piece, t)) {
      pieces_.push_back(piece);
    }
  }

  /// Sends a piece that is beyond edge i of a triangle to the neighbour there.
  void hand_over(Piece& piece, std::uint32_t from, std::uint32_t i, std::uint32_t came_from) {
    piece.target = to_.neighbour(from, i);
    // Over an edge between two triangles, a piece may be outside of both: it is nearest to the
    // edge.
    if (piece.target == came_from) {
      if (came_from != kNoIndex && accept_by(piece, to_.triangle(came_from))) return;
      piece.target = kNoIndex;
    }
    if (piece.target != kNoIndex || !accept_by(piece, to_.triangle(from))) pieces_.push_back(piece);
  }

  bool accept(const Piece& piece, bool at_once) {
    const glm::dvec3 middle = piece.middle();
    double radius = 0;
    for (const glm::dvec3& corner : piece.all()) {
      radius = std::max(radius, glm::length(corner - middle));
    }
    const double margin = std::max(0.0, limit() - radius);
    const double distance = find_nearest(middle, piece.before, margin);
    // Within the radius no point is farther off than so.
    const double upper = std::min(distance + radius, corner_bound(piece));
    if (upper > limit() && !at_once) return false;
    bound_ = std::max(bound_, upper);
    return true;
  }

  [[nodiscard]] double corner_bound(const Piece& piece) {
    const std::array<glm::dvec3, 3> t = to_.triangle(nearest_);
    double greatest = 0;
    for (const glm::dvec3& corner : piece.all()) {
      greatest = std::max(greatest, distance_square(corner, t));
    }
    return std::sqrt(greatest);
  }

  /// Separates the part over the nearest triangle, which is mostly settled then, from the parts
  /// next to it.
  void divide(Piece piece) {
    piece.before = nearest_;
    const std::array<glm::dvec3, 3> t = to_.triangle(nearest_);
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
        part.before = piece.before;
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

  /// The distance of a point from a triangle near it, and from the nearest of all where it may be
  /// the greatest so far. before: a triangle that is probably near, or kNoIndex.
  double find_nearest(const glm::dvec3& point, std::uint32_t before, double margin) {
    const double most = std::max(margin, lower_);
    NearTriangle near;
    near.square = std::numeric_limits<double>::infinity();
    if (before != kNoIndex) near = to_.nearest_around(point, before);
    if (near.square > most * most) {
      near = to_.nearest(point, margin * margin, near);
      // A triangle found within the margin need not be the nearest: it proves no distance.
      if (near.square > margin * margin) raise_lower(std::sqrt(near.square));
    }
    nearest_ = near.triangle;
    return std::sqrt(near.square);
  }

  void raise_lower(double distance) {
    lower_ = std::max(lower_, distance);
    limit_ = std::max(limit_, kSlack * lower_);
  }
  [[nodiscard]] double limit() const { return limit_; }
  [[nodiscard]] double quick_limit() const {
    return std::max({kDistanceFloor, bound_, kQuick * lower_});
  }
  [[nodiscard]] double limit_square() const { return limit_ * limit_; }

  BasicLevelSurface<Index>& to_;
  double lower_ = 0;  ///< a distance that was found
  double limit_;      ///< pieces within it need no closer look
  double bound_;
  std::size_t pieces_left_;
  std::vector<Piece> pieces_;
  std::uint32_t nearest_ = kNoIndex;  ///< what find_nearest() found last
};

}  // namespace

template <class Index>
double surface_distance(const BasicLevelSurface<Index>& from, BasicLevelSurface<Index>& to,
                        std::span<const std::uint32_t> nearby, double least, double found,
                        std::span<const std::uint8_t> settled) {
  Bounder<Index> bounder(to, least, found, kPieces * (from.triangles() + std::size_t{64}));
  const bool same_positions = from.positions().data() == to.positions().data();
  std::vector<std::uint32_t> left;
  std::vector<std::pair<double, Index>> probes;
  std::vector<double> squares(nearby.size(), -1.0);
  for (std::uint32_t t = 0; t < from.triangles(); ++t) {
    if (!settled.empty() && settled[t] != 0) continue;
    const Index* v = from.corners(t);
    if (same_positions && to.find(v[0], v[1], v[2]) != kNoIndex) continue;
    left.push_back(t);
    for (std::size_t k = 0; k < 3; ++k) {
      if (nearby[v[k]] == kNoIndex || squares[v[k]] >= 0) continue;
      squares[v[k]] = distance_square(from.position(v[k]), to.triangle(nearby[v[k]]));
      probes.emplace_back(squares[v[k]], v[k]);
    }
  }
  bounder.probe(from, std::move(probes), nearby);
  for (const std::uint32_t t : left) {
    const Index* v = from.corners(t);
    const std::array<glm::dvec3, 3> corners = from.triangle(t);
    const std::array<std::uint32_t, 3> near = {nearby[v[0]], nearby[v[1]], nearby[v[2]]};
    if (bounder.cover_by_corners(corners, near, {squares[v[0]], squares[v[1]], squares[v[2]]})) {
      continue;
    }
    // Of levels over the same positions, most triangles are as large as those of the other.
    if (!same_positions && from.triangles() < to.triangles() && near[0] != kNoIndex) {
      bounder.cover_by_quarters(corners, near[0]);
      continue;
    }
    Piece whole;
    for (const glm::dvec3& corner : corners) whole.add(corner);
    bounder.cover(whole, near);
  }
  return bounder.bound();
}

template double surface_distance(const BasicLevelSurface<std::uint16_t>&,
                                 BasicLevelSurface<std::uint16_t>&, std::span<const std::uint32_t>,
                                 double, double, std::span<const std::uint8_t>);
template double surface_distance(const BasicLevelSurface<std::uint32_t>&,
                                 BasicLevelSurface<std::uint32_t>&, std::span<const std::uint32_t>,
                                 double, double, std::span<const std::uint8_t>);

}  // namespace modar
