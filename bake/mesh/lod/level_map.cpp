// Places vertices, traces edges, fills triangles, and looks which coarse triangles are covered.
#include "bake/mesh/lod/level_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <queue>
#include <span>
#include <tuple>
#include <utility>

#include <glm/geometric.hpp>

#include "bake/mesh/lod/surface_distance.hpp"

namespace modar {
namespace {

/// Coarse triangles that an edge's line may cross from either end, before the long search. Lower
/// starts the slow search more often. [6, 24] tuned: lod
constexpr std::uint8_t kFewCrossed = 12;
constexpr std::uint8_t kMostCrossed = 60;
/// Coarse triangles searched for a way where no plane leads along one. Fewer leave more edges
/// unmapped, more take time. [25, 400] tuned: lod
constexpr std::size_t kMostSearched = 100;
/// Triangles crossed by all lines of an edge, dead ends included. Models need up to 7.
constexpr std::size_t kStepsAnEdge = 100;
constexpr std::uint8_t kUntraced = 0xFF;
constexpr std::uint16_t kNoVertex = 0xFFFF;

/// Position of a vertex on the coarser level.
struct Place {
  glm::dvec3 point{0.0};
  double square = 0;  ///< of its distance from the vertex
  std::uint32_t triangle = kNoIndex;
  /// The element under it: a vertex, an edge or all corners of a triangle; the others are
  /// kNoVertex.
  std::array<std::uint16_t, 3> on{kNoVertex, kNoVertex, kNoVertex};

  [[nodiscard]] bool at_vertex() const { return on[1] == kNoVertex; }
};

using Line = std::array<glm::dvec3, 2>;  ///< from one point to another

/// The line that an edge becomes: from triangle to triangle, each adjacent to the one before.
struct Path {
  double square = 0;  ///< greatest, of the distance of its crossings from the edge
  std::uint32_t first = 0;
  std::uint32_t along = kNoIndex;  ///< the corner of the coarse edge that it runs along
  std::uint8_t count = kUntraced;
};

/// The coarse triangles that the outline of a triangle goes through, in a ring.
class Outline {
 public:
  void clear() { count_ = 0; }
  void add(std::uint32_t triangle) {
    if (count_ == 0 || all_[count_ - 1] != triangle) all_[count_++] = triangle;
  }
  [[nodiscard]] bool has(std::uint32_t triangle) const {
    return std::find(all_.begin(), all_.begin() + count_, triangle) != all_.begin() + count_;
  }
  [[nodiscard]] std::span<const std::uint32_t> triangles() const { return {all_.data(), count_}; }

  /// Remaining cases where another one does not return by the same way: at most two where it can
  /// be drawn together to a point. Coarse triangles meet in a vertex or an edge, so there is one
  /// way.
  void set_core_of(const Outline& whole) {
    Outline& left = *this;
    left.count_ = 0;
    for (const std::uint32_t t : whole.triangles()) {
      if (left.count_ > 1 && left.all_[left.count_ - 2] == t) {
        --left.count_;
      } else {
        left.add(t);
      }
    }
    // The same where its end meets its beginning.
    std::size_t first = 0;
    std::size_t& end = left.count_;
    while (end > first + 1) {
      if (left.all_[end - 1] == left.all_[first] || left.all_[end - 2] == left.all_[first]) {
        --end;
      } else if (left.all_[end - 1] == left.all_[first + 1]) {
        ++first;
      } else {
        break;
      }
    }
    std::copy(left.all_.begin() + first, left.all_.begin() + end, left.all_.begin());
    end -= first;
  }

 private:
  static constexpr std::size_t kMost = 3 * kMostCrossed;
  std::array<std::uint32_t, kMost> all_;  // the first count_ are set
  std::size_t count_ = 0;
};

class LevelMap {
 public:
  LevelMap(const LevelSurface& fine, LevelSurface& coarse, std::vector<std::uint32_t>& nearby,
           double least)
      : fine_(fine),
        coarse_(coarse),
        least_(least),
        bound_(least),
        steps_left_(kStepsAnEdge * fine.indices().size()),
        places_(fine.vertices()),
        paths_(fine.indices().size()),
        mapped_(fine.triangles(), 0),
        settled_(fine.triangles(), 0),
        far_(coarse.triangles(), 0),
        torn_(coarse.triangles(), 0),
        touches_(coarse.triangles(), 0),
        same_(coarse.triangles(), 0),
        covered_(coarse.triangles(), 0) {
    for (const std::uint16_t v : fine.indices()) {
      if (places_[v].triangle == kNoIndex && nearby[v] != kNoIndex) place(v, nearby[v]);
    }
    find_farthest(nearby);
    for (std::uint32_t c = 0; c < paths_.size(); ++c) {
      if (first_of(c) == c) trace(c);
    }
    for (std::uint32_t t = 0; t < fine.triangles(); ++t) map(t);
    spread();
  }

  [[nodiscard]] double bound() const { return bound_; }
  [[nodiscard]] double found() const { return found_; }
  /// Of each triangle of the finer and of the coarser level: does the bound hold for it?
  [[nodiscard]] std::span<const std::uint8_t> settled() const { return settled_; }
  [[nodiscard]] std::span<const std::uint8_t> covered() const { return covered_; }

 private:
  [[nodiscard]] double limit() const { return std::max({kDistanceFloor, least_, kSlack * found_}); }
  /// The one of an edge's two corners that has its path.
  [[nodiscard]] std::uint32_t first_of(std::uint32_t corner) const {
    return std::min(corner, fine_.opposite(corner));
  }
  [[nodiscard]] bool has_corner(std::uint32_t triangle, std::uint16_t vertex) const {
    const std::uint16_t* v = coarse_.corners(triangle);
    return v[0] == vertex || v[1] == vertex || v[2] == vertex;
  }
  [[nodiscard]] bool is_on(const Place& place, std::uint32_t triangle) const {
    return triangle == place.triangle ||
           std::all_of(place.on.begin(), place.on.end(),
                       [&](std::uint16_t v) { return v == kNoVertex || has_corner(triangle, v); });
  }

  /// Is the line between two places inside one triangle, and no edge of it?
  [[nodiscard]] static bool within(const Place& a, const Place& b) {
    return a.triangle == b.triangle && !(a.at_vertex() && b.at_vertex());
  }

  void place(std::uint16_t vertex, std::uint32_t triangle) {
    Place& place = places_[vertex];
    place.triangle = triangle;
    const std::uint16_t* v = coarse_.corners(triangle);
    if (has_corner(triangle, vertex)) {
      place.point = fine_.position(vertex);
      place.square = 0;
      place.on = {vertex, kNoVertex, kNoVertex};
      return;
    }
    const std::array<glm::dvec3, 3> t = coarse_.triangle(triangle);
    const ClosestPoint closest = closest_point(fine_.position(vertex), t);
    place.point = t[0] + closest.b * (t[1] - t[0]) + closest.c * (t[2] - t[0]);
    const glm::dvec3 off = fine_.position(vertex) - place.point;
    place.square = glm::dot(off, off);
    std::size_t count = 0;
    place.on.fill(kNoVertex);
    if (closest.b + closest.c < 1) place.on[count++] = v[0];
    if (closest.b > 0) place.on[count++] = v[1];
    if (closest.c > 0) place.on[count++] = v[2];
  }

  /// Finds how far the farthest vertex is off, and better places for those that seem to be farther:
  /// near their places first, then among all triangles.
  void find_farthest(std::vector<std::uint32_t>& nearby) {
    struct FarVertex {
      double square;
      std::uint16_t vertex;
      bool near_known;
      bool operator<(const FarVertex& other) const {
        return std::tie(square, vertex) < std::tie(other.square, other.vertex);
      }
    };
    std::vector<FarVertex> farther;
    for (std::uint32_t v = 0; v < places_.size(); ++v) {
      if (places_[v].square <= limit() * limit()) continue;
      farther.push_back({places_[v].square, static_cast<std::uint16_t>(v), false});
    }
    std::priority_queue<FarVertex> far(std::less<FarVertex>(), std::move(farther));
    while (!far.empty() && far.top().square > limit() * limit()) {
      const auto [square, v, near_known] = far.top();
      far.pop();
      const NearTriangle nearest =
          near_known ? coarse_.nearest(fine_.position(v), found_ * found_, {square, nearby[v]})
                     : coarse_.nearest_around(fine_.position(v), nearby[v]);
      nearby[v] = nearest.triangle;
      place(v, nearest.triangle);
      if (near_known) {
        found_ = std::max(found_, std::sqrt(nearest.square));
      } else {
        far.push({nearest.square, v, true});
      }
    }
  }

  /// Finds the path of an edge.
  void trace(std::uint32_t corner) {
    const std::uint16_t a = fine_.indices()[corner];
    const std::uint16_t b = fine_.indices()[next_corner(corner)];
    const Place& from = places_[a];
    const Place& to = places_[b];
    if (from.triangle == kNoIndex || to.triangle == kNoIndex) return;
    Path& path = paths_[corner];
    path.first = static_cast<std::uint32_t>(steps_.size());
    if (within(from, to)) {
      steps_.push_back(from.triangle);
      path.count = 1;
      return;
    }
    if (from.at_vertex() && to.at_vertex()) {
      if (from.on[0] == to.on[0]) {
        path.count = 0;
        return;
      }
      path.along = coarse_.edge(from.on[0], to.on[0]);
      if (path.along == kNoIndex) path.along = coarse_.edge(to.on[0], from.on[0]);
      if (path.along != kNoIndex) {
        path.count = 1;
        return;
      }
    }
    path = trace_line(from, to, {fine_.position(a), fine_.position(b)});
  }

  /// Finds the path of a line between two points that have these places.
  Path trace_line(const Place& from, const Place& to, const Line& line) {
    Path path;
    path.first = static_cast<std::uint32_t>(steps_.size());
    const auto walks = [&](bool backwards, std::uint8_t most) {
      const Place& begin = backwards ? to : from;
      const Place& end = backwards ? from : to;
      const Line along = backwards ? Line{line[1], line[0]} : line;
      path.square = walk(begin, end, begin.triangle, along, most);
      // From a vertex, the line may start in any triangle around it.
      for (std::size_t i = 0; path.square < 0 && begin.at_vertex(); ++i) {
        const std::span<const std::uint32_t> around = coarse_.corners_at(begin.on[0]);
        if (i == around.size() || steps_left_ < most) break;
        steps_.resize(path.first);
        path.square = walk(begin, end, around[i] / 3, along, most);
      }
      if (path.square < 0) {
        steps_.resize(path.first);
        return false;
      }
      if (path.square > limit() * limit()) path.square = move_crossings(path.first, along);
      if (backwards) std::reverse(steps_.begin() + path.first, steps_.end());
      return true;
    };
    const bool first = from.at_vertex();
    if (walks(first, kFewCrossed) || walks(!first, kFewCrossed) || walks(first, kMostCrossed) ||
        walks(!first, kMostCrossed)) {
      path.count = static_cast<std::uint8_t>(steps_.size() - path.first);
    } else if (search(from, to)) {
      path.square = move_crossings(path.first, line);
      path.count = static_cast<std::uint8_t>(steps_.size() - path.first);
    }
    return path;
  }

  /// Appends the fewest triangles that lead from one place to another, for lines that no plane
  /// leads along. False where there are too many.
  bool search(const Place& from, const Place& to) {
    if (steps_left_ < kMostSearched) return false;
    steps_left_ -= kMostSearched;
    seen_.assign(1, {from.triangle, 0});
    for (std::uint32_t i = 0; i < seen_.size(); ++i) {
      if (is_on(to, seen_[i].triangle)) return append_way_to(i);
      for (std::uint32_t k = 0; k < 3 && seen_.size() < kMostSearched; ++k) {
        const std::uint32_t next = coarse_.neighbour(seen_[i].triangle, k);
        const auto same = [next](const SearchStep& other) { return other.triangle == next; };
        if (next == kNoIndex || std::any_of(seen_.begin(), seen_.end(), same)) continue;
        seen_.push_back({next, i});
      }
    }
    return false;
  }

  /// Appends the triangles from the first one seen to another.
  bool append_way_to(std::uint32_t i) {
    const auto first = static_cast<std::ptrdiff_t>(steps_.size());
    steps_.push_back(seen_[i].triangle);
    for (; i != 0; i = seen_[i].before) steps_.push_back(seen_[seen_[i].before].triangle);
    std::reverse(steps_.begin() + first, steps_.end());
    if (steps_.size() - static_cast<std::size_t>(first) <= kMostCrossed) return true;
    steps_.resize(static_cast<std::size_t>(first));
    return false;
  }

  /// Appends the triangles from one place to another, along a plane perpendicular to the first one.
  /// Returns the greatest squared distance of a crossing from an edge of the finer level; below
  /// zero if it does not arrive within this number of triangles.
  double walk(const Place& from, const Place& to, std::uint32_t at, const Line& line,
              std::uint8_t most) {
    if (steps_left_ < most) return -1;
    --steps_left_;
    steps_.push_back(at);
    if (is_on(to, at)) return 0;
    const std::array<glm::dvec3, 3> t = coarse_.triangle(at);
    const glm::dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
    const glm::dvec3 left = glm::cross(normal, to.point - from.point);
    const double origin = glm::dot(left, from.point);
    const glm::dvec3& begin = line[0];
    const glm::dvec3 whole = line[1] - begin;
    const double length = glm::dot(whole, whole);
    // It leaves over the edge that goes from its right to its left.
    std::array<double, 3> sides;
    for (std::size_t i = 0; i < 3; ++i) sides[i] = glm::dot(left, t[i]) - origin;
    std::uint32_t i = 0;
    while (i < 3 && !(sides[i] <= 0 && sides[(i + 1) % 3] > 0)) ++i;
    if (i == 3) return -1;
    std::uint32_t corner = 3 * at + i;
    double right_side = sides[i];
    double left_side = sides[(i + 1) % 3];
    double greatest = 0;
    double there = 0;
    for (std::uint8_t steps = 1; steps < most; ++steps, --steps_left_) {
      const glm::dvec3& right_end = coarse_.position(coarse_.indices()[corner]);
      const glm::dvec3& left_end = coarse_.position(coarse_.indices()[next_corner(corner)]);
      const double share = right_side / (right_side - left_side);
      const glm::dvec3 off = right_end + share * (left_end - right_end) - begin;
      // No crossing is before the last one.
      if (length > 0) there = std::clamp(glm::dot(off, whole) / length, there, 1.0);
      const glm::dvec3 apart = off - there * whole;
      greatest = std::max(greatest, glm::dot(apart, apart));
      const std::uint32_t back = coarse_.opposite(corner);
      if (back == kNoIndex) return -1;
      const std::uint16_t last = coarse_.indices()[next_corner(next_corner(corner))];
      at = back / 3;
      steps_.push_back(at);
      if (is_on(to, at)) return greatest;
      // Over the edge from the right end to the third vertex, or from that to the left end.
      corner = next_corner(back);
      const std::uint16_t third = coarse_.indices()[next_corner(corner)];
      if (third == last) return -1;
      const double side = glm::dot(left, coarse_.position(third)) - origin;
      if (side > 0) {
        left_side = side;
      } else {
        right_side = side;
        corner = next_corner(corner);
      }
    }
    return -1;
  }

  /// Moves the crossings of a walk along the coarse edges to where these are nearest to the finer
  /// level's edge. Returns what walk() does.
  [[nodiscard]] double move_crossings(std::uint32_t first, const Line& ends) const {
    const glm::dvec3& begin = ends[0];
    const glm::dvec3 line = ends[1] - begin;
    const double length = glm::dot(line, line);
    double greatest = 0;
    double there = 0;
    for (std::size_t i = first; i + 1 < steps_.size(); ++i) {
      std::uint32_t k = 0;
      while (k < 2 && coarse_.neighbour(steps_[i], k) != steps_[i + 1]) ++k;
      const std::uint32_t corner = 3 * steps_[i] + k;
      const glm::dvec3& side = coarse_.position(coarse_.indices()[corner]);
      const glm::dvec3 across = coarse_.position(coarse_.indices()[next_corner(corner)]) - side;
      const glm::dvec3 off = begin - side;
      const double both = glm::dot(line, across);
      const double width = glm::dot(across, across);
      const double area = length * width - both * both;
      if (area > 0) {
        there = std::clamp((both * glm::dot(across, off) - width * glm::dot(line, off)) / area,
                           there, 1.0);
      }
      const glm::dvec3 apart = off + there * line;
      const double share = width > 0 ? std::clamp(glm::dot(apart, across) / width, 0.0, 1.0) : 0.0;
      const glm::dvec3 gap = apart - share * across;
      greatest = std::max(greatest, glm::dot(gap, gap));
    }
    return greatest;
  }

  [[nodiscard]] const Path& path_of(std::uint32_t corner) const { return paths_[first_of(corner)]; }

  /// Adds what a triangle's edge goes through.
  void add_to(Outline& ring, std::uint32_t corner) const {
    const Path& path = path_of(corner);
    const bool forwards = first_of(corner) == corner;
    if (path.along != kNoIndex) {
      // Between two triangles, it is in both.
      const std::uint32_t beyond = coarse_.opposite(path.along);
      const bool other = beyond != kNoIndex && (ring.has(beyond / 3) || !forwards);
      ring.add(other && !ring.has(path.along / 3) ? beyond / 3 : path.along / 3);
      return;
    }
    for (std::uint8_t i = 0; i < path.count; ++i) {
      ring.add(steps_[path.first + (forwards ? i : path.count - 1u - i)]);
    }
  }

  /// Fills ring_ with the triangles that the outline of one goes through; along: how many of its
  /// edges run along coarse ones. Returns the greatest square of its corners and edges, below zero
  /// where some edge has no path.
  double outline(std::uint32_t t, int& along) {
    const std::uint16_t* v = fine_.corners(t);
    const Place& a = places_[v[0]];
    const Place& b = places_[v[1]];
    const Place& c = places_[v[2]];
    double square = std::max({a.square, b.square, c.square});
    ring_.clear();
    if (within(a, b) && within(b, c) && within(c, a)) {
      if (a.triangle == kNoIndex) return -1;
      ring_.add(a.triangle);
      return square;
    }
    // Edges along coarse ones last: they may choose.
    std::uint32_t begin = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const Path& path = path_of(3 * t + k);
      if (path.count == kUntraced) return -1;
      square = std::max(square, path.square);
      if (path.along == kNoIndex) continue;
      begin = k + 1;
      ++along;
    }
    for (std::uint32_t k = begin; k < begin + 3; ++k) add_to(ring_, 3 * t + k % 3);
    return square;
  }

  /// Maps a triangle to what its outline encloses, if it can be.
  void map(std::uint32_t t) {
    int along = 0;
    double square = outline(t, along);
    if (square < 0) return;
    if (ring_.triangles().size() > 2) {
      core_.set_core_of(ring_);
      if (!fan(core_, t, square)) return;
    }
    mapped_[t] = 1;
    for (const std::uint32_t at : ring_.triangles()) {
      touches_[at] = static_cast<std::uint8_t>(std::min(touches_[at] + 1, 2));
    }
    if (along == 3 && ring_.triangles().size() == 1) {
      const std::uint32_t at = ring_.triangles()[0];
      const std::uint16_t* v = fine_.corners(t);
      same_[at] = coarse_.find(v[0], v[1], v[2]) == at ? 1 : 0;
    }
    if (square <= limit() * limit()) {
      settled_[t] = 1;
      bound_ = std::max(bound_, std::sqrt(square));
      return;
    }
    for (const std::uint32_t at : ring_.triangles()) far_[at] = 1;
  }

  /// Have all triangles of a ring a common vertex, if there are more than two? Then the triangle is
  /// mapped to its fan, and some point of it to that vertex.
  bool fan(const Outline& ring, std::uint32_t t, double& square) const {
    const std::span<const std::uint32_t> all = ring.triangles();
    if (all.size() <= 2) return true;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint16_t hub = coarse_.corners(all[0])[k];
      if (!std::all_of(all.begin(), all.end(),
                       [&](std::uint32_t at) { return has_corner(at, hub); })) {
        continue;
      }
      square = std::max(square, distance_square(coarse_.position(hub), fine_.triangle(t)));
      return true;
    }
    return false;
  }

  /// Finds the coarse triangles that are covered. Where no border of the mapped part passes, a
  /// triangle is covered like its neighbours; and once, at a border of both levels, and where it is
  /// one of the finer level and nothing else comes there.
  void spread() {
    std::vector<std::int8_t> borders(coarse_.indices().size(), 0);
    std::vector<std::uint8_t> walls(coarse_.indices().size(), 0);
    for (std::uint32_t c = 0; c < paths_.size(); ++c) {
      if (mapped_[c / 3] == 0) continue;
      const std::uint32_t beyond = fine_.opposite(c);
      if (beyond != kNoIndex && mapped_[beyond / 3] != 0) continue;
      const Path& path = path_of(c);
      if (path.along == kNoIndex) {
        for (std::uint8_t i = 0; i < path.count; ++i) torn_[steps_[path.first + i]] = 1;
        continue;
      }
      walls[path.along] = 1;
      if (coarse_.opposite(path.along) != kNoIndex) walls[coarse_.opposite(path.along)] = 1;
      const bool same = places_[fine_.indices()[c]].on[0] == coarse_.indices()[path.along];
      borders[path.along] = static_cast<std::int8_t>(borders[path.along] + (same ? 1 : -1));
    }
    std::vector<std::uint32_t> waiting;
    const auto cover = [&](std::uint32_t t) {
      if (torn_[t] != 0 || covered_[t] != 0) return;
      covered_[t] = 1;
      waiting.push_back(t);
    };
    for (std::uint32_t c = 0; c < borders.size(); ++c) {
      if (borders[c] != 0 && is_border(c)) cover(c / 3);
    }
    for (std::uint32_t t = 0; t < same_.size(); ++t) {
      if (same_[t] != 0 && touches_[t] == 1) cover(t);
    }
    while (!waiting.empty()) {
      const std::uint32_t t = waiting.back();
      waiting.pop_back();
      for (std::uint32_t c = 3 * t; c < 3 * t + 3; ++c) {
        const std::uint32_t beyond = coarse_.opposite(c);
        if (beyond != kNoIndex && walls[c] == 0) cover(beyond / 3);
      }
    }
    for (std::uint32_t t = 0; t < far_.size(); ++t) {
      if (far_[t] != 0) covered_[t] = 0;
    }
  }

  /// Has the coarse edge this triangle only?
  [[nodiscard]] bool is_border(std::uint32_t corner) const {
    const std::uint16_t a = coarse_.indices()[corner];
    const std::uint16_t b = coarse_.indices()[next_corner(corner)];
    return coarse_.edge(a, b) == corner && !coarse_.has_edge(b, a);
  }

  const LevelSurface& fine_;
  LevelSurface& coarse_;
  double least_;
  double found_ = 0;  ///< a distance that a vertex has
  double bound_;
  std::size_t steps_left_;
  std::vector<Place> places_;         // of each vertex
  std::vector<Path> paths_;           // of each corner of the finer level, see first_of()
  std::vector<std::uint32_t> steps_;  // of all paths
  /// A triangle that search() has looked at, and from which of them it came.
  struct SearchStep {
    std::uint32_t triangle;
    std::uint32_t before;
  };
  std::vector<SearchStep> seen_;
  Outline ring_;  // of the triangle that is being mapped, and the rest of it
  Outline core_;
  std::vector<std::uint8_t> mapped_;  // of each triangle of the finer level: without a tear
  std::vector<std::uint8_t> settled_;
  std::vector<std::uint8_t> far_;   // of each of the coarser: is one mapped there that is far off?
  std::vector<std::uint8_t> torn_;  // does a border pass through it?
  std::vector<std::uint8_t> touches_;  // how many are mapped to it or next to it: 0, 1 or more
  std::vector<std::uint8_t> same_;     // is one mapped to it that has its corners?
  std::vector<std::uint8_t> covered_;
};

}  // namespace

double level_distance(LevelSurface& fine, LevelSurface& coarse, std::vector<std::uint32_t> nearby,
                      const std::vector<std::uint32_t>& of_fine, double least) {
  const LevelMap map(fine, coarse, nearby, least);
  const double up = surface_distance(fine, coarse, nearby, map.bound(), map.found(), map.settled());
  return surface_distance(coarse, fine, of_fine, up, map.found(), map.covered());
}

}  // namespace modar
