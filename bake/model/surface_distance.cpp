// Divides triangles until each piece is known to lie within the bound.
#include "bake/model/surface_distance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include "bake/model/triangle_tree.hpp"

namespace modar {
namespace {

constexpr double kSlack = 1.5;     ///< of the bound over a distance that was found
constexpr std::size_t kProbe = 8;  ///< one triangle of so many is looked at first

constexpr double kSliver = 1e-9;  ///< model space: narrower parts are not cut off
/// Pieces of one triangle; the rest is bounded as it is, by more than it need be.
constexpr std::size_t kMostPieces = 2000;

/// A convex piece of a triangle.
struct Piece {
  static constexpr std::size_t kMost = 8;
  std::array<glm::dvec3, kMost> corners;
  std::size_t count = 0;

  void add(const glm::dvec3& corner) { corners[count++] = corner; }
  [[nodiscard]] std::span<const glm::dvec3> all() const { return {corners.data(), count}; }
  [[nodiscard]] glm::dvec3 middle() const {
    glm::dvec3 sum(0.0);
    for (const glm::dvec3& corner : all()) sum += corner;
    return sum / static_cast<double>(count);
  }
};

/// The parts of a piece on either side of a plane through `point`, whose normal has unit length: at
/// most one corner more each.
void cut(const Piece& piece, const glm::dvec3& point, const glm::dvec3& normal, Piece& behind,
         Piece& before) {
  behind.count = before.count = 0;
  double low = 0;
  double high = 0;
  for (std::size_t i = 0; i < piece.count; ++i) {
    const glm::dvec3& a = piece.corners[i];
    const glm::dvec3& b = piece.corners[i + 1 == piece.count ? 0 : i + 1];
    const double at_a = glm::dot(a - point, normal);
    const double at_b = glm::dot(b - point, normal);
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
  explicit Bounder(LevelTree& tree) : tree_(tree) {}

  /// Finds a distance that occurs.
  void probe(const Piece& piece) {
    for (const glm::dvec3& corner : piece.all()) {
      lower_ = std::max(lower_, std::sqrt(tree_.nearest(corner, lower_ * lower_)));
    }
  }

  /// Grows the bound to hold for every point of the triangle.
  void cover(const Piece& whole) {
    pieces_.assign(1, whole);
    std::size_t pieces = 0;
    while (!pieces_.empty()) {
      const Piece piece = pieces_.back();
      pieces_.pop_back();
      if (!accept(piece, ++pieces > kMostPieces)) divide(piece);
    }
  }

  [[nodiscard]] double bound() const { return bound_; }

 private:
  bool accept(const Piece& piece, bool at_once) {
    const glm::dvec3 middle = piece.middle();
    double radius = 0;
    for (const glm::dvec3& corner : piece.all()) {
      radius = std::max(radius, glm::length(corner - middle));
    }
    const double room = std::max(0.0, limit() - radius);
    const double distance = std::sqrt(tree_.nearest(middle, room * room));
    // What is found within the room need not be the nearest: it proves no distance.
    if (distance > room) lower_ = std::max(lower_, distance);
    // Within the radius no point is farther off than so.
    const double upper = std::min(distance + radius, corner_bound(piece));
    if (upper > limit() && !at_once) return false;
    bound_ = std::max(bound_, upper);
    return true;
  }

  /// The distance from one triangle is convex, so that the corners bound the piece.
  [[nodiscard]] double corner_bound(const Piece& piece) const {
    double greatest = 0;
    for (const glm::dvec3& corner : piece.all()) {
      greatest = std::max(greatest, distance_square(corner, tree_.last()));
    }
    return std::sqrt(greatest);
  }

  /// Parts what lies over the nearest triangle, which is mostly done with then, from what lies
  /// beside it.
  void divide(Piece piece) {
    const std::array<glm::dvec3, 3> t = tree_.last();
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
      // No room for another corner: the piece as triangles.
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

  [[nodiscard]] double limit() const { return std::max(kDistanceFloor, kSlack * lower_); }

  LevelTree& tree_;
  double lower_ = 0;
  double bound_ = 0;
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

double surface_distance(std::span<const glm::dvec3> positions, std::span<const std::uint16_t> from,
                        std::span<const std::uint16_t> to) {
  LevelTree tree(positions, to);
  Bounder bounder(tree);
  const std::vector<std::size_t> triangles = changed(from, to);
  const auto piece = [&](std::size_t i) {
    Piece whole;
    for (std::size_t k = 0; k < 3; ++k) whole.add(positions[from[i + k]]);
    return whole;
  };
  for (std::size_t k = 0; k < triangles.size(); k += kProbe) bounder.probe(piece(triangles[k]));
  for (const std::size_t i : triangles) bounder.cover(piece(i));
  return bounder.bound();
}

}  // namespace modar
