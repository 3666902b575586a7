// Subdivides triangles until each piece is known to lie within the bound.
#include "bake/mesh/lod/surface_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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
    : positions_(positions),
      indices_(indices),
      begins_(positions.size() + 2, 0),
      corners_(indices.size()),
      neighbours_(indices.size(), kNoIndex) {
  // Corners by vertex: each stands for the edge that begins there.
  for (const std::uint16_t v : indices) ++begins_[v + std::size_t{2}];
  std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
  for (std::uint32_t c = 0; c < indices.size(); ++c) {
    corners_[begins_[indices[c] + std::size_t{1}]++] = c;
  }
  for (std::size_t c = 0; c < indices.size(); ++c) {
    const std::uint16_t to = indices[next_corner(c)];
    for (std::uint32_t i = begins_[to]; i < begins_[to + std::size_t{1}]; ++i) {
      if (indices[next_corner(corners_[i])] != indices[c]) continue;
      neighbours_[c] = corners_[i] / 3;
      break;
    }
  }
}

bool LevelSurface::has(const std::uint16_t* corners) const {
  for (std::uint32_t i = begins_[corners[0]]; i < begins_[corners[0] + std::size_t{1}]; ++i) {
    const std::size_t second = next_corner(corners_[i]);
    if (indices_[second] == corners[1] && indices_[next_corner(second)] == corners[2]) return true;
  }
  return false;
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

/// A triangle whose corners alone prove that it is off by no more than this factor of a distance
/// that was found needs no look at what lies between them. Set by hand: more loosens the bound.
constexpr double kQuick = 1.15;

/// Points whose nearest triangle is found among all: most surfaces need a few, for which a tree
/// would take longer to build.
constexpr int kScans = 4;

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

/// A point as seen along the normal of a triangle.
struct SeenPoint {
  std::array<double, 3> beyond;  ///< how far it lies outside of each edge
  double height;                 ///< over the plane
  unsigned outside;              ///< bit i: it does not lie inside of edge i, or by a sliver only
};

/// The corners of a triangle, as seen.
using SeenTriangle = std::array<const SeenPoint*, 3>;

/// Sees points along the normal of a triangle.
class TriangleView {
 public:
  /// False where the triangle has no area.
  bool look_at(const std::array<glm::dvec3, 3>& t) {
    const glm::dvec3 across = glm::cross(t[1] - t[0], t[2] - t[0]);
    const double square = glm::dot(across, across);
    if (!(square > 0)) return false;
    normal_ = across / std::sqrt(square);
    for (std::size_t i = 0; i < 3; ++i) {
      outwards_[i] = glm::normalize(glm::cross(t[(i + 1) % 3] - t[i], normal_));
      edges_[i] = glm::dot(t[i], outwards_[i]);
    }
    plane_ = glm::dot(t[0], normal_);
    return true;
  }
  [[nodiscard]] SeenPoint seen(const glm::dvec3& p) const {
    SeenPoint point;
    point.outside = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      point.beyond[i] = glm::dot(p, outwards_[i]) - edges_[i];
      if (point.beyond[i] > -kSliver) point.outside |= 1u << i;
    }
    point.height = glm::dot(p, normal_) - plane_;
    return point;
  }
  /// The part of the triangle that is looked at which another one covers, as seen.
  [[nodiscard]] Piece covered(const SeenTriangle& seen,
                              const std::array<glm::dvec3, 3>& corners) const {
    struct Corner {
      std::array<double, 3> beyond;
      glm::dvec3 p;
    };
    std::array<Corner, 6> part;  // each of three edges adds one corner
    for (std::size_t i = 0; i < 3; ++i) part[i] = {seen[i]->beyond, corners[i]};
    std::size_t count = 3;
    for (std::size_t edge = 0; edge < 3; ++edge) {
      std::array<Corner, 6> inside;
      std::size_t kept = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const Corner& a = part[i];
        const Corner& b = part[i + 1 == count ? 0 : i + 1];
        if (a.beyond[edge] <= 0 && kept < inside.size()) inside[kept++] = a;
        if (!(a.beyond[edge] * b.beyond[edge] < 0) || kept == inside.size()) continue;
        const double at = a.beyond[edge] / (a.beyond[edge] - b.beyond[edge]);
        Corner& between = inside[kept++];
        for (std::size_t k = 0; k < 3; ++k) {
          between.beyond[k] = a.beyond[k] + at * (b.beyond[k] - a.beyond[k]);
        }
        between.p = a.p + at * (b.p - a.p);
      }
      std::copy_n(inside.begin(), kept, part.begin());
      count = kept;
    }
    Piece piece;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3& p = part[i].p;
      piece.add(p - normal_ * (glm::dot(p, normal_) - plane_));
    }
    return piece;
  }

 private:
  glm::dvec3 normal_{0.0};
  std::array<glm::dvec3, 3> outwards_{};
  std::array<double, 3> edges_{};
  double plane_ = 0;
};

/// Does the line from a to b meet the inside of the triangle that it is seen from?
bool meets_inside(const SeenPoint& a, const SeenPoint& b) {
  double from = 0;
  double to = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    const double off = a.beyond[i] + kSliver;
    const double change = b.beyond[i] - a.beyond[i];
    if (change > 0) to = std::min(to, -off / change);
    if (change < 0) from = std::max(from, -off / change);
  }
  return from < to;
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

/// How often the edge from a to b goes upwards through a ray from a point, by the first two of
/// their distances: summed up round triangles, how many of them lie over the point, those that face
/// away counted negative. Both triangles of an edge count it alike.
int crossings(const SeenPoint& a, const SeenPoint& b, const SeenPoint& point) {
  const bool upwards = b.beyond[1] > point.beyond[1];
  if ((a.beyond[1] > point.beyond[1]) == upwards) return 0;
  const SeenPoint& low = upwards ? a : b;
  const SeenPoint& high = upwards ? b : a;
  const double at = (point.beyond[1] - low.beyond[1]) / (high.beyond[1] - low.beyond[1]);
  if (low.beyond[0] + at * (high.beyond[0] - low.beyond[0]) <= point.beyond[0]) return 0;
  return upwards ? 1 : -1;
}

class Bounder {
 public:
  Bounder(LevelSurface& to, double least)
      : to_(to),
        limit_(std::max(kDistanceFloor, least)),
        bound_(least),
        visited_(to.indices().size() / 3, 0),
        places_(to.vertices()) {
    points_.reserve(to.vertices());  // references to them last
  }

  /// Finds the distance of the farthest of some points, whose squared distances are at most these.
  void probe(std::vector<std::pair<double, std::uint16_t>> points) {
    std::make_heap(points.begin(), points.end());
    while (!points.empty() && points.front().first > std::max(lower_ * lower_, limit_square())) {
      raise_lower(std::sqrt(nearest(to_.position(points.front().second), lower_ * lower_)));
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

  /// Raises the bound to hold for the triangle, where the other surface covers it: seen along the
  /// triangle's normal, the connected triangles of the other one that meet it end outside of it,
  /// and those over its middle do not cancel. Then (by the degree of the projection) they cover all
  /// of it, and no point of it lies farther from them than they do; parts that seem too far off
  /// are looked at closely. start: a triangle of the other surface that probably shares a vertex
  /// with this one, `shared`. False where it is not so.
  bool cover_by_view(const std::array<glm::dvec3, 3>& t, std::uint32_t start,
                     std::uint16_t shared) {
    if (start == kNoIndex || !view_.look_at(t)) return false;
    const SeenPoint middle = view_.seen((t[0] + t[1] + t[2]) / 3.0);
    if (middle.outside != 0) return false;
    ++stamp_;
    waiting_.assign(1, start);
    visited_[start] = stamp_;
    pieces_.clear();
    points_.clear();
    double greatest = 0;
    int layers = 0;
    while (!waiting_.empty()) {
      const std::uint32_t at = waiting_.back();
      waiting_.pop_back();
      const std::uint16_t* v = &to_.indices()[3 * std::size_t{at}];
      const SeenTriangle p = {&seen(v[0]), &seen(v[1]), &seen(v[2])};
      const bool meets = (p[0]->outside & p[1]->outside & p[2]->outside) == 0;
      if (meets) {
        double height = 0;
        for (const SeenPoint* corner : p) height = std::max(height, std::abs(corner->height));
        if (height <= limit()) {
          greatest = std::max(greatest, height);
        } else if (Piece part = view_.covered(p, to_.triangle(at));
                   !accept_by(part, to_.triangle(at))) {
          part.target = at;
          if (part.count >= 3) pieces_.push_back(part);
        }
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        if (meets) layers += crossings(*p[i], *p[j], middle);
        const bool on = meets && (p[i]->outside & p[j]->outside) == 0;
        if (!on && at != start && v[i] != shared && v[j] != shared) continue;
        const std::uint32_t next = to_.neighbour(at, i);
        if (next == kNoIndex) {
          if (on && meets_inside(*p[i], *p[j])) return false;
        } else if (visited_[next] != stamp_) {
          visited_[next] = stamp_;
          waiting_.push_back(next);
        }
      }
    }
    if (layers == 0) return false;
    bound_ = std::max(bound_, greatest);
    settle();
    return true;
  }

  [[nodiscard]] double bound() const { return bound_; }

 private:
  /// Raises the bound to hold for all pieces that wait.
  void settle() {
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
    const double distance = std::sqrt(nearest(middle, margin * margin));
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
      greatest = std::max(greatest, distance_square(corner, nearest_));
    }
    return std::sqrt(greatest);
  }

  /// Separates the part over the nearest triangle, which is mostly settled then, from the parts
  /// beside it.
  void divide(Piece piece) {
    const std::array<glm::dvec3, 3> t = nearest_;
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

  /// As TriangleTree::nearest(); the first few times by looking at all triangles.
  double nearest(const glm::dvec3& point, double enough) {
    if (scans_ == kScans) {
      const double square = to_.tree().nearest(point, enough);
      nearest_ = to_.tree().last();
      return square;
    }
    ++scans_;
    double best = std::numeric_limits<double>::infinity();
    std::uint32_t found = 0;
    for (std::uint32_t t = 0; t < to_.indices().size() / 3 && best > enough; ++t) {
      const double square = distance_square(point, to_.triangle(t), best);
      if (square >= best) continue;
      best = square;
      found = t;
    }
    nearest_ = to_.triangle(found);
    return best;
  }

  const SeenPoint& seen(std::uint16_t vertex) {
    PointPlace& place = places_[vertex];
    if (place.view != stamp_) {
      place = {stamp_, static_cast<std::uint32_t>(points_.size())};
      points_.push_back(view_.seen(to_.position(vertex)));
    }
    return points_[place.number];
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

  LevelSurface& to_;
  double lower_ = 0;  ///< a distance that was found
  double limit_;      ///< pieces within it need no closer look
  double bound_;
  std::vector<Piece> pieces_;
  int scans_ = 0;
  std::array<glm::dvec3, 3> nearest_{};  ///< the triangle that nearest() found last
  // Of cover_by_view().
  TriangleView view_;
  std::uint32_t stamp_ = 0;             ///< of the view at hand
  std::vector<std::uint32_t> visited_;  ///< of each triangle: the view that it was visited in
  struct PointPlace {
    std::uint32_t view = 0;
    std::uint32_t number = 0;
  };
  std::vector<PointPlace> places_;  ///< of each vertex: where its point is, and in which view
  std::vector<SeenPoint> points_;   ///< of the view at hand
  std::vector<std::uint32_t> waiting_;
};

}  // namespace

double surface_distance(const LevelSurface& from, LevelSurface& to,
                        std::span<const std::uint32_t> nearby, double least) {
  Bounder bounder(to, least);
  const std::span<const std::uint16_t> corners = from.indices();
  std::vector<std::size_t> changed;  // triangles that `to` does not have
  std::vector<std::pair<double, std::uint16_t>> probes;
  std::vector<double> squares(nearby.size(), -1.0);
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    if (to.has(&corners[i])) continue;
    changed.push_back(i);
    for (std::size_t k = i; k < i + 3; ++k) {
      const std::uint16_t v = corners[k];
      if (nearby[v] == kNoIndex || squares[v] >= 0) continue;
      squares[v] = distance_square(from.position(v), to.triangle(nearby[v]));
      probes.emplace_back(squares[v], v);
    }
  }
  bounder.probe(std::move(probes));
  for (const std::size_t i : changed) {
    const std::uint16_t* v = &corners[i];
    const std::array<glm::dvec3, 3> corner = from.triangle(static_cast<std::uint32_t>(i / 3));
    const std::array<std::uint32_t, 3> near = {nearby[v[0]], nearby[v[1]], nearby[v[2]]};
    if (bounder.cover_by_corners(corner, near, {squares[v[0]], squares[v[1]], squares[v[2]]})) {
      continue;
    }
    if (bounder.cover_by_view(corner, near[0], v[0])) continue;
    Piece whole;
    for (const glm::dvec3& c : corner) whole.add(c);
    bounder.cover(whole, near);
  }
  return bounder.bound();
}

}  // namespace modar
