// Subdivides triangles until each piece is known to lie within the bound.
#include "bake/mesh/lod/surface_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

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

class Bounder {
 public:
  Bounder(LevelSurface& to, double least) : to_(to), least_(least), bound_(least) {}

  /// Finds the distance of the farthest of some points, whose squared distances are at most these.
  void probe(std::vector<std::pair<double, std::uint16_t>> points) {
    std::make_heap(points.begin(), points.end());
    while (!points.empty() && points.front().first > std::max(lower_ * lower_, limit_square())) {
      const glm::dvec3& point = to_.position(points.front().second);
      lower_ = std::max(lower_, std::sqrt(to_.tree().nearest(point, lower_ * lower_)));
      std::pop_heap(points.begin(), points.end());
      points.pop_back();
    }
  }

  /// Raises the bound to hold for every point of the triangle; tries `nearby` first.
  void cover(Piece whole, const std::array<std::uint32_t, 3>& nearby) {
    for (const std::uint32_t near : nearby) {
      if (near != kNoIndex && accept_by(whole, to_.triangle(near))) return;
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
  /// there.
  void step(Piece piece) {
    const std::uint32_t target = piece.target;
    const std::array<glm::dvec3, 3> t = to_.triangle(target);
    if (accept_by(piece, t)) return;
    const std::uint32_t came_from = std::exchange(piece.before, target);
    piece.target = kNoIndex;
    const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    if (!(glm::dot(normal, normal) > 0)) {
      pieces_.push_back(piece);
      return;
    }
    Piece outside;
    Piece inside;
    for (std::size_t i = 0; i < 3 && piece.count < Piece::kMost; ++i) {
      cut(piece, t[i], glm::normalize(glm::cross(t[(i + 1) % 3] - t[i], normal)), inside, outside);
      if (outside.count < 3) continue;
      outside.before = target;
      outside.target = to_.neighbour(target, i);
      // Near an edge, a piece may lie outside of both triangles that share it.
      if (outside.target == came_from) outside.target = kNoIndex;
      if (outside.target != kNoIndex || !accept_by(outside, t)) pieces_.push_back(outside);
      if (inside.count < 3) return;
      piece.corners = inside.corners;
      piece.count = inside.count;
    }
    if (!accept_by(piece, t)) pieces_.push_back(piece);
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
    if (distance > margin) lower_ = std::max(lower_, distance);
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

  [[nodiscard]] double limit() const { return std::max({kDistanceFloor, least_, kSlack * lower_}); }
  [[nodiscard]] double limit_square() const { return limit() * limit(); }

  LevelSurface& to_;
  double least_;
  double lower_ = 0;
  double bound_;
  std::vector<Piece> pieces_;
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
    Piece whole;
    for (std::size_t k = i; k < i + 3; ++k) whole.add(from.position(corners[k]));
    bounder.cover(whole, {nearby[corners[i]], nearby[corners[i + 1]], nearby[corners[i + 2]]});
  }
  return bounder.bound();
}

}  // namespace modar
