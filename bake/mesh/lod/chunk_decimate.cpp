// Collapses edges of one chunk in the order of their quadric error.
#include "bake/mesh/lod/chunk_decimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include <glm/geometric.hpp>

#include "bake/import/source_model.hpp"
#include "bake/mesh/lod/collapse_limits.hpp"
#include "bake/mesh/lod/quadric.hpp"
#include "bake/mesh/rays/triangle_tree.hpp"

namespace modar {
namespace {

/// A triangle that is kept, by its number, and its corners.
struct KeptTriangle {
  std::uint32_t face = 0;
  std::array<std::uint16_t, 3> corners{};
};

struct Projection {
  const KeptTriangle* face = nullptr;
  ClosestPoint closest;
};

Projection nearest_of(const ChunkVertices& vertices, std::uint16_t vertex,
                      std::span<const KeptTriangle> faces) {
  Projection nearest;
  for (const KeptTriangle& face : faces) {
    const auto& [a, b, c] = face.corners;
    const ClosestPoint closest =
        closest_point(vertices.positions[vertex],
                      {vertices.positions[a], vertices.positions[b], vertices.positions[c]});
    if (nearest.face == nullptr || closest.square < nearest.closest.square)
      nearest = {&face, closest};
  }
  return nearest;
}

double shift_at(const ChunkVertices& vertices, std::uint16_t vertex, const Projection& projection) {
  const auto& [a, b, c] = projection.face->corners;
  const std::span<const glm::dvec2> uvs = vertices.uvs;
  const glm::dvec2 there =
      uvs[a] + projection.closest.b * (uvs[b] - uvs[a]) + projection.closest.c * (uvs[c] - uvs[a]);
  return glm::length(there - uvs[vertex]);
}

/// The distance between a vertex' uv and the uv of the nearest point of some triangles (at least
/// one).
double uv_shift_of(const ChunkVertices& vertices, std::uint16_t vertex,
                   std::span<const KeptTriangle> faces) {
  return shift_at(vertices, vertex, nearest_of(vertices, vertex, faces));
}

/// Maps every removed vertex to a triangle of the remaining surface: the nearest of those that
/// replaced its triangles, updated whenever one of them changes. Measures how far the texture has
/// slid there. Does nothing for vertices without uv.
class RemovedVertexMap {
 public:
  /// The vertices are the caller's and must outlive it.
  RemovedVertexMap(const ChunkVertices& vertices, std::size_t faces) : vertices_(vertices) {
    if (vertices.uvs.empty()) return;
    first_.assign(faces, kNoIndex);
    next_.assign(vertices.positions.size(), kNoIndex);
    uv_shifts_.assign(faces, 0.0);
  }

  /// Detaches the removed vertices of a triangle that changes or vanishes.
  void detach_triangle(std::uint32_t face) {
    if (vertices_.uvs.empty()) return;
    for (std::uint32_t v = first_[face]; v != kNoIndex; v = next_[v]) {
      detached_.push_back(static_cast<std::uint16_t>(v));
    }
    first_[face] = kNoIndex;
    uv_shifts_[face] = 0;
  }
  /// Adds a vertex that is being removed.
  void detach_vertex(std::uint16_t vertex) {
    if (!vertices_.uvs.empty()) detached_.push_back(vertex);
  }
  /// Maps all detached vertices to the nearest of some triangles (at least one).
  void reattach(std::span<const KeptTriangle> faces) {
    for (const std::uint16_t vertex : detached_) {
      const Projection projection = nearest_of(vertices_, vertex, faces);
      const std::uint32_t face = projection.face->face;
      next_[vertex] = first_[face];
      first_[face] = vertex;
      uv_shifts_[face] = std::max(uv_shifts_[face], shift_at(vertices_, vertex, projection));
    }
    detached_.clear();
  }

  /// Greatest of uv_shift_of() of the vertices on the triangle.
  [[nodiscard]] double uv_shift(std::uint32_t face) const { return uv_shifts_[face]; }
  /// The same, if they were mapped to the nearest of some other triangles (at least one).
  [[nodiscard]] double uv_shift_on(std::uint32_t face, std::span<const KeptTriangle> faces) const {
    double greatest = 0;
    for (std::uint32_t v = first_[face]; v != kNoIndex; v = next_[v]) {
      greatest = std::max(greatest, uv_shift_of(vertices_, static_cast<std::uint16_t>(v), faces));
    }
    return greatest;
  }

 private:
  ChunkVertices vertices_;
  std::vector<std::uint32_t> first_;  // of each face, the vertices on it as a linked list
  std::vector<std::uint32_t> next_;   // of each vertex
  std::vector<double> uv_shifts_;     // of each face
  std::vector<std::uint16_t> detached_;
};

/// Weight of the texture's shift against the surface's error in a collapse's price. Higher keeps
/// textures in place, lower keeps shapes. [0.06, 1] tuned: lod
constexpr double kShiftWeight = 0.25;
/// Vertices by price, cheapest first; in the order of insertion where prices differ by less than a
/// sixteenth.
class PriceQueue {
 public:
  explicit PriceQueue(std::size_t vertices)
      : heads_(kBuckets, kNone),
        tails_(kBuckets, kNone),
        next_(vertices, kNone),
        before_(vertices, kNone),
        buckets_(vertices, kNone) {}

  /// Adds a vertex, or gives it another price.
  void put(std::uint16_t v, float price) {
    remove(v);
    const std::uint16_t bucket = bucket_of(price);
    buckets_[v] = bucket;
    before_[v] = std::exchange(tails_[bucket], v);
    (before_[v] == kNone ? heads_[bucket] : next_[before_[v]]) = v;
    lowest_ = std::min(lowest_, bucket);
  }
  void remove(std::uint16_t v) {
    const std::uint16_t bucket = std::exchange(buckets_[v], kNone);
    if (bucket == kNone) return;
    (before_[v] == kNone ? heads_[bucket] : next_[before_[v]]) = next_[v];
    (next_[v] == kNone ? tails_[bucket] : before_[next_[v]]) = before_[v];
    next_[v] = before_[v] = kNone;
  }
  /// kNone where it is empty.
  std::uint16_t take_front() {
    const std::uint16_t v = front();
    if (v != kNone) remove(v);
    return v;
  }
  /// Is there a cheaper one?
  bool has_below(float price) { return front() != kNone && lowest_ < bucket_of(price); }

  static constexpr std::uint16_t kNone = 0xFFFF;

 private:
  // Buckets of prices: floats of one sign sort by their bits, of which these are the exponent and
  // the first of the mantissa.
  static constexpr std::size_t kBuckets = 1 << 12;
  static std::uint16_t bucket_of(float price) {
    return static_cast<std::uint16_t>(__builtin_bit_cast(std::uint32_t, price) << 1 >> 20);
  }
  std::uint16_t front() {
    while (lowest_ + std::size_t{1} < kBuckets && heads_[lowest_] == kNone) ++lowest_;
    return heads_[lowest_];
  }

  std::vector<std::uint16_t> heads_;  // of each bucket
  std::vector<std::uint16_t> tails_;
  std::vector<std::uint16_t> next_;  // of each vertex
  std::vector<std::uint16_t> before_;
  std::vector<std::uint16_t> buckets_;
  std::uint16_t lowest_ = 0;
};

/// Half-edge collapses, cheapest first. A price in the queue is a lower bound at first (the
/// quadrics alone, legal or not); it becomes exact when it reaches the front.
class Decimator {
 public:
  Decimator(const ChunkVertices& vertices, std::span<const std::uint16_t> indices,
            std::span<const std::uint8_t> locked, const DecimateLimits& limits)
      : vertices_(vertices),
        limits_(limits),
        all_(vertices.positions.size()),
        quadrics_(vertices.positions.size()),
        fan_sizes_(vertices.positions.size(), 0),
        sides_(vertices.positions.size(), 0),
        queue_(vertices.positions.size()),
        removed_(vertices, indices.size() / 3) {
    for (std::size_t v = 0; v < all_.size(); ++v) all_[v].position = vertices.positions[v];
    add_triangles(indices);
    for (std::uint32_t v = 0; v < locked.size(); ++v) {
      const Kind kind = kind_of(static_cast<std::uint16_t>(v));
      if (locked[v] == 0) all_[v].kind = kind;
    }
    for (std::uint32_t v = 0; v < vertices.twins.size(); ++v) {
      const std::uint16_t twin = vertices.twins[v];
      if (twin == kNoTwin) continue;
      if (all_[v].kind == Kind::kRim && all_[twin].kind == Kind::kRim) continue;
      all_[v].kind = all_[twin].kind = Kind::kLocked;
    }
  }

  CollapseSequence run() {
    for (std::size_t v = 0; v < all_.size(); ++v) all_[v].take(quadrics_[v]);
    for (std::size_t v = 0; v < all_.size(); ++v) {
      if (const auto w = static_cast<std::uint16_t>(v); first_of(w) == w) estimate(w);
    }
    while (alive_count_ > limits_.least_triangles && looks_left_ > 0 && step()) continue;
    return std::move(sequence_);
  }

 private:
  using Triangle = std::array<std::uint16_t, 3>;
  /// Inside the surface, on a rim of it, or to be kept.
  enum class Kind : std::uint8_t { kInside, kRim, kLocked };
  /// Of a vertex: the collapse to try next; to itself where none is legal.
  struct BestCollapse {
    float price = 0;
    std::uint16_t to = 0;
    std::uint16_t across = kNoTwin;
    bool exact = false;
    bool least = false;  ///< no other has a lower price by the quadrics
  };
  /// Queried for each neighbour, in one line of the cache.
  struct alignas(64) Vertex {
    glm::dvec3 position{0.0};
    double own = 0;  ///< its quadric there
    double area = 0;
    std::uint32_t first = kNoIndex;  ///< its first corner
    std::uint32_t mark = 0;
    BestCollapse best;
    Kind kind = Kind::kLocked;

    void take(const Quadric& quadric) {
      own = quadric.at(position);
      area = quadric.area;
    }
  };
  /// A vertex' way to a neighbour, and its twin's to the same place.
  struct Move {
    double price = 0;
    std::uint16_t to = 0;
    std::uint16_t across = kNoTwin;
    bool operator<(const Move& other) const {
      return std::tie(price, to) < std::tie(other.price, other.to);
    }
  };
  [[nodiscard]] const glm::dvec3& position(std::uint16_t v) const { return all_[v].position; }
  [[nodiscard]] std::uint16_t twin(std::uint16_t v) const {
    return vertices_.twins.empty() ? kNoTwin : vertices_.twins[v];
  }
  /// The one of two twins that represents both in the queue.
  [[nodiscard]] std::uint16_t first_of(std::uint16_t v) const { return std::min(v, twin(v)); }

  void add_triangles(std::span<const std::uint16_t> indices) {
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      const Triangle t = {indices[i], indices[i + 1], indices[i + 2]};
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      const auto first_corner = static_cast<std::uint32_t>(corners_.size());
      const Quadric plane = Quadric::of_triangle(position(t[0]), position(t[1]), position(t[2]));
      for (std::uint32_t k = 0; k < 3; ++k) {
        corners_.push_back({all_[t[k]].first, t[(k + 1) % 3], t[(k + 2) % 3]});
        all_[t[k]].first = first_corner + k;
        ++fan_sizes_[t[k]];
        quadrics_[t[k]] += plane;
      }
    }
    alive_count_ = corners_.size() / 3;
    looks_left_ = kLooksATriangle * alive_count_;
  }

  /// Calls back with the corner of each triangle at v and the two vertices that follow v in it.
  template <typename Callback>
  void around(std::uint16_t v, const Callback& callback) {
    visit_fan(all_[v].first, corners_, looks_left_, callback);
  }

  /// A vertex whose triangles form one closed fan is inside, one with one open fan on a rim; others
  /// are not manifold and stay. Adds the quadric of the rim's edge that leaves the vertex.
  Kind kind_of(std::uint16_t v) {
    fan_.clear();
    ++mark_;
    bool twice = false;
    around(v, [&](std::uint32_t, std::uint16_t a, std::uint16_t b) {
      fan_.emplace_back(a, b);
      twice = twice || all_[b].mark == mark_;
      all_[b].mark = mark_;
    });
    if (fan_.empty()) return Kind::kLocked;
    std::sort(fan_.begin(), fan_.end());
    std::pair<std::uint16_t, std::uint16_t> start = fan_[0];
    for (std::size_t i = 0; i < fan_.size(); ++i) {
      twice = twice || (i > 0 && fan_[i].first == fan_[i - 1].first);
      if (all_[fan_[i].first].mark != mark_) start = fan_[i];  // no triangle before it
    }
    const bool open = all_[start.first].mark != mark_;
    std::size_t steps = 0;
    for (std::uint16_t at = start.first; steps < fan_.size(); ++steps) {
      const auto next = std::lower_bound(fan_.begin(), fan_.end(), std::pair(at, std::uint16_t{0}));
      if (next == fan_.end() || next->first != at) break;
      at = next->second;
      if (at == start.first) {
        ++steps;
        break;
      }
    }
    if (twice || steps != fan_.size()) return Kind::kLocked;
    if (open) add_rim_edge(v, start.first, start.second);
    return open ? Kind::kRim : Kind::kInside;
  }

  /// A plane through the edge from v to w, across its only triangle.
  void add_rim_edge(std::uint16_t v, std::uint16_t w, std::uint16_t third) {
    const Quadric plane = Quadric::of_border(position(v), position(w), position(third), 1.0);
    quadrics_[v] += plane;
    quadrics_[w] += plane;
  }

  /// Calls back with each vertex that v may collapse to: its neighbours, on a rim those of the rim.
  template <typename Callback>
  void targets_of(std::uint16_t v, const Callback& callback) {
    if (all_[v].kind == Kind::kInside) {
      around(v, [&](std::uint32_t, std::uint16_t u, std::uint16_t) { callback(u); });
      return;
    }
    around(v, [&](std::uint32_t, std::uint16_t a, std::uint16_t b) {
      sides_[a] |= 1u;
      sides_[b] |= 2u;
    });
    around(v, [&](std::uint32_t, std::uint16_t a, std::uint16_t b) {
      if (sides_[a] == 1) callback(a);
      if (sides_[b] == 2) callback(b);
    });
    around(v, [&](std::uint32_t, std::uint16_t a, std::uint16_t b) { sides_[a] = sides_[b] = 0; });
  }

  /// Of a collapse, by the quadrics: the squared distance summed over the area, over its root. A
  /// sum alone leaves spikes and a mean spends triangles on small ones: on a bust at an eighth the
  /// root has the least rms (2.21e-4 of the diagonal; sum 2.27, mean 2.26 at 0.7) and a greatest
  /// error between (1.8e-3; 2.6, 1.5).
  [[nodiscard]] double price_of(std::uint16_t v, std::uint16_t u) const {
    const double sum = quadrics_[v].at(position(u)) + all_[u].own;
    const double area = all_[v].area + all_[u].area;
    return area > 0 ? std::max(0.0, sum) / std::sqrt(area) : 0.0;
  }

  /// Lists where v may go, with its twin, priced by the quadrics alone.
  void list_moves(std::uint16_t v) {
    moves_.clear();
    targets_of(v, [&](std::uint16_t u) { moves_.push_back({price_of(v, u), u}); });
    if (twin(v) == kNoTwin) return;
    across_.clear();
    targets_of(twin(v), [&](std::uint16_t u) { across_.push_back(u); });
    // Where a seam ends at a rim, the two sides part: the end stays.
    bool alike = moves_.size() == across_.size();
    for (Move& move : moves_) {
      const auto there = std::find_if(across_.begin(), across_.end(), [&](std::uint16_t u) {
        return position(u) == position(move.to);
      });
      alike = alike && there != across_.end();
      if (!alike) break;
      move.across = *there;
      move.price += price_of(twin(v), *there);
    }
    if (!alike) moves_.clear();
  }

  /// Queues the cheapest collapse of v by the quadrics alone.
  void estimate(std::uint16_t v) {
    if (all_[v].kind == Kind::kLocked) return;
    moves_.clear();
    if (fan_sizes_[v] < kWidestCollapse) list_moves(v);
    const auto least = std::min_element(moves_.begin(), moves_.end());
    all_[v].best.to = v;
    if (least == moves_.end()) return queue_.remove(v);
    queue(v, {static_cast<float>(least->price), least->to, least->across, false, true});
  }

  void queue(std::uint16_t v, const BestCollapse& best) {
    all_[v].best = best;
    queue_.put(v, best.price);
  }

  /// Takes the front of the queue: makes its price exact, or collapses. False where it is empty.
  bool step() {
    while (true) {
      const std::uint16_t v = queue_.take_front();
      if (v == PriceQueue::kNone) return false;
      if (!all_[v].best.exact && !find_legal(v)) continue;
      const BestCollapse best = all_[v].best;
      if (queue_.has_below(best.price)) {
        queue(v, best);
        continue;
      }
      collapse(v, best.to, best.price, best.across != kNoTwin);
      if (best.across != kNoTwin) collapse(twin(v), best.across, best.price, false);
      return true;
    }
  }

  /// Finds the cheapest legal collapse of v, exactly priced.
  bool find_legal(std::uint16_t v) {
    // Without uvs the quadrics tell the whole price.
    if (all_[v].best.least && vertices_.uvs.empty() && twin(v) == kNoTwin &&
        legal_price(v, all_[v].best.to)) {
      all_[v].best.exact = true;
      return true;
    }
    list_moves(v);
    std::sort(moves_.begin(), moves_.end());
    Move best;
    best.price = std::numeric_limits<double>::infinity();
    best.to = v;
    for (Move move : moves_) {
      if (move.price >= best.price) break;
      std::optional<double> price = legal_price(v, move.to);
      if (price && move.across != kNoTwin) {
        const std::optional<double> other = legal_price(twin(v), move.across);
        price = other ? std::optional(*price + *other) : std::nullopt;
      }
      if (!price || *price >= best.price) continue;
      best = move;
      best.price = *price;
    }
    const bool least = !moves_.empty() && best.to == moves_[0].to;
    all_[v].best = {static_cast<float>(best.price), best.to, best.across, true, least};
    return best.to != v;
  }

  /// The exact price of a collapse; nothing where it is not allowed.
  std::optional<double> legal_price(std::uint16_t v, std::uint16_t u) {
    if (fan_sizes_[v] + fan_sizes_[u] > kWidestCollapse) return std::nullopt;
    double price = price_of(v, u);
    const double root = std::sqrt(all_[v].area + all_[u].area);
    if (price > limits_.max_error * limits_.max_error * root) return std::nullopt;
    if (folds(v, u) || turns(v, u)) return std::nullopt;
    if (vertices_.uvs.empty()) return price;
    const double shift = shift_after(v, u);
    if (shift > limits_.max_uv_shift) return std::nullopt;
    const double slide = shift * limits_.length_of_uv;
    price += kShiftWeight * all_[v].area * slide * slide / root;
    return price;
  }

  /// Have v and u other common neighbours than those of the triangles between them, or no other
  /// triangle? Then the surface would fold onto itself, or vanish.
  bool folds(std::uint16_t v, std::uint16_t u) {
    ++mark_;
    int between = 0;
    int others = 0;
    around(v, [&](std::uint32_t, std::uint16_t a, std::uint16_t b) {
      all_[a].mark = all_[b].mark = mark_;
      ++(a == u || b == u ? between : others);
    });
    all_[u].mark = 0;
    int common = 0;
    const auto count = [&](std::uint16_t w) {
      if (all_[w].mark != mark_) return;
      all_[w].mark = 0;
      ++common;
    };
    around(u, [&](std::uint32_t, std::uint16_t a, std::uint16_t b) { count(a), count(b); });
    return common != between || others == 0;
  }

  /// Would a triangle that stays turn too far, or lose its area?
  bool turns(std::uint16_t v, std::uint16_t u) {
    bool found = false;
    const glm::dvec3& from = position(v);
    const glm::dvec3& to = position(u);
    around(v, [&](std::uint32_t, std::uint16_t a, std::uint16_t b) {
      if (found || a == u || b == u) return;
      found = turns_too_far(position(a), position(b), from, to);
    });
    return found;
  }

  /// Lists the remaining triangles, in their form after the collapse.
  void collect(std::uint16_t v, std::uint16_t u) {
    kept_.clear();
    around(v, [&](std::uint32_t corner, std::uint16_t a, std::uint16_t b) {
      if (a != u && b != u) kept_.push_back({corner / 3, {u, a, b}});
    });
  }

  /// The shift that the collapse leads to at v and the vertices that its triangles represent; a
  /// bound on it where that is allowed: that of v, compared with the error of its triangles.
  double shift_after(std::uint16_t v, std::uint16_t u) {
    double before = 0;
    around(v, [&](std::uint32_t corner, std::uint16_t, std::uint16_t) {
      before = std::max(before, removed_.uv_shift(corner / 3));
    });
    collect(v, u);
    double shift = uv_shift_of(vertices_, v, kept_);
    if (before + shift <= limits_.max_uv_shift) return before + shift;
    around(v, [&](std::uint32_t corner, std::uint16_t, std::uint16_t) {
      shift = std::max(shift, removed_.uv_shift_on(corner / 3, kept_));
    });
    return shift;
  }

  /// paired: the twin's collapse follows.
  void collapse(std::uint16_t v, std::uint16_t u, float price, bool paired) {
    removed_.detach_vertex(v);
    if (!vertices_.uvs.empty()) collect(v, u);
    ring_.clear();
    std::uint32_t last = kNoIndex;
    around(v, [&](std::uint32_t corner, std::uint16_t a, std::uint16_t b) {
      const std::uint32_t t = corner / 3;
      removed_.detach_triangle(t);
      ring_.push_back(a);
      ring_.push_back(b);
      if (a == u || b == u) {
        for (std::uint32_t k = 0; k < 3; ++k) corners_[3 * t + k].leave();
        for (const std::uint16_t w : {v, a, b}) --fan_sizes_[w];
        --alive_count_;
        return;
      }
      // It becomes one of u.
      const std::array<std::uint32_t, 2>& others = kOtherCorners[corner - 3 * t];
      corners_[3 * t + others[0]].b = u;
      corners_[3 * t + others[1]].a = u;
      last = corner;
    });
    if (last != kNoIndex) {
      corners_[last].next = all_[u].first;
      all_[u].first = all_[v].first;
    }
    all_[v].first = kNoIndex;
    all_[v].kind = Kind::kLocked;
    fan_sizes_[u] += fan_sizes_[v];
    removed_.reattach(kept_);
    quadrics_[u] += quadrics_[v];
    all_[u].take(quadrics_[u]);
    const float before = sequence_.prices.empty() ? 0.0f : sequence_.prices.back();
    sequence_.collapses.push_back({v, u});
    sequence_.prices.push_back(std::max(before, price));
    sequence_.paired.push_back(paired ? 1 : 0);
    sequence_.triangles.push_back(static_cast<std::uint32_t>(alive_count_));
    update(v, u);
  }

  /// Prices again what a collapse of v to u has changed: u, those that would have gone to either,
  /// and the vertices around the removed one (ring_), to which u is near now.
  void update(std::uint16_t v, std::uint16_t u) {
    around(u, [&](std::uint32_t, std::uint16_t a, std::uint16_t b) {
      if (aims_at(a, u)) ring_.push_back(a);
      if (aims_at(b, u)) ring_.push_back(b);
    });
    ring_.push_back(u);
    ++mark_;
    for (const std::uint16_t neighbour : ring_) {
      const std::uint16_t w = first_of(neighbour);
      if (std::exchange(all_[w].mark, mark_) == mark_) continue;
      BestCollapse& best = all_[w].best;
      const bool known = w != first_of(u) && best.to != w && !aims_at(w, u) && !aims_at(w, v);
      if (all_[w].kind != Kind::kInside || !known) {
        estimate(w);
      } else if (const auto price = static_cast<float>(price_of(w, u)); price < best.price) {
        queue(w, {price, u, kNoTwin, false, best.least});
      } else {
        best.exact = false;
      }
    }
  }

  [[nodiscard]] bool aims_at(std::uint16_t a, std::uint16_t u) const {
    const BestCollapse& best = all_[first_of(a)].best;
    return best.to == u || best.across == u;
  }

  ChunkVertices vertices_;
  DecimateLimits limits_;
  std::vector<FanCorner<std::uint16_t>> corners_;  // three a triangle
  std::size_t alive_count_ = 0;
  std::vector<Vertex> all_;
  std::vector<Quadric> quadrics_;         // of each vertex
  std::vector<std::uint32_t> fan_sizes_;  // triangles at each vertex
  std::vector<std::uint8_t> sides_;       // of each vertex, while targets are listed: 1 begins a
                                          // triangle's edge across, 2 ends one
  std::size_t looks_left_ = 0;
  std::uint32_t mark_ = 0;
  PriceQueue queue_;
  RemovedVertexMap removed_;
  CollapseSequence sequence_;
  std::vector<std::uint16_t> ring_;
  std::vector<std::pair<std::uint16_t, std::uint16_t>> fan_;
  std::vector<Move> moves_;
  std::vector<std::uint16_t> across_;
  std::vector<KeptTriangle> kept_;
};

}  // namespace

CollapseSequence decimate_chunk(const ChunkVertices& vertices,
                                std::span<const std::uint16_t> indices,
                                std::span<const std::uint8_t> locked,
                                const DecimateLimits& limits) {
  return Decimator(vertices, indices, locked, limits).run();
}

std::vector<std::uint16_t> collapsed_vertices(const CollapseSequence& sequence, std::size_t count,
                                              std::size_t vertex_count) {
  std::vector<std::uint16_t> become(vertex_count);
  std::iota(become.begin(), become.end(), std::uint16_t{0});
  // From the last collapse back: what a vertex collapses to has its final place already.
  for (std::size_t i = count; i-- > 0;) {
    become[sequence.collapses[i].from] = become[sequence.collapses[i].to];
  }
  return become;
}

}  // namespace modar
