// Collapses the edges of a whole mesh, chunks and seams or not. Internal to lod.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "bake/import/source_model.hpp"
#include "bake/mesh/lod/collapse_limits.hpp"
#include "bake/mesh/lod/quadric.hpp"

namespace modar {

/// What a picture shows at a corner of a triangle: corners at one place share it inside a uv island
/// of one material.
struct CornerLook {
  glm::dvec2 uv{0.0};
  glm::vec4 colour{0.0f};
};

/// How a corner is shaded: corners at one place share it where the surface is smooth.
struct CornerShade {
  glm::vec3 normal{0.0f};
  float occlusion = 0.0f;
};

/// A triangle whose corners are at places, and have looks and shades.
struct CollapseFace {
  std::array<std::uint32_t, 3> places{};
  std::array<std::uint32_t, 3> looks{};
  std::array<std::uint32_t, 3> shades{};
  std::uint32_t material = 0;
};

/// A mesh as collapses see it. A look, and a shade, belongs to one place. Faces may have no area,
/// and two of their corners at one place: those are gone.
struct CollapseMesh {
  std::vector<glm::dvec3> places;
  std::vector<Quadric> quadrics;  ///< of each place: of the surface that it represents
  std::vector<CornerLook> looks;
  std::vector<CornerShade> shades;
  std::vector<CollapseFace> faces;
};

/// Candidates of collapses, cheapest first. The dearer ones wait aside, without an order, until the
/// others are used up: most are never asked for.
template <class Candidate>
class CollapseQueue {
 public:
  /// Starts again with all of these, of which about this many will be taken.
  void fill(std::vector<Candidate> all, std::size_t taken) {
    aside_ = std::move(all);
    heap_.clear();
    draw(taken);
  }
  [[nodiscard]] bool empty() const { return heap_.empty() && aside_.empty(); }
  void clear() {
    heap_.clear();
    aside_.clear();
    most_ = std::numeric_limits<float>::infinity();
  }
  void push(const Candidate& candidate) {
    if (candidate.price > most_) {
      aside_.push_back(candidate);
      return;
    }
    heap_.push_back(candidate);
    std::push_heap(heap_.begin(), heap_.end());
  }
  /// Takes the cheapest of those that there are.
  Candidate take() {
    if (heap_.empty()) draw(aside_.size() / 4);
    std::pop_heap(heap_.begin(), heap_.end());
    const Candidate best = heap_.back();
    heap_.pop_back();
    return best;
  }

 private:
  /// Orders this many of those aside, and all of the price of the last of them.
  void draw(std::size_t count) {
    most_ = std::numeric_limits<float>::infinity();
    const auto dearer = [](const Candidate& a, const Candidate& b) { return a.price < b.price; };
    if (count < aside_.size()) {
      const auto last = aside_.begin() + static_cast<std::ptrdiff_t>(count);
      std::nth_element(aside_.begin(), last, aside_.end(), dearer);
      most_ = last->price;
    }
    const auto stay = std::partition(aside_.begin(), aside_.end(),
                                     [&](const Candidate& c) { return c.price > most_; });
    heap_.assign(stay, aside_.end());
    aside_.erase(stay, aside_.end());
    std::make_heap(heap_.begin(), heap_.end());
  }

  std::vector<Candidate> heap_;
  std::vector<Candidate> aside_;
  float most_ = std::numeric_limits<float>::infinity();  ///< price of those in the heap
};

/// Edge collapses, cheapest first, each to the point where the quadrics of its two ends are least.
/// Every look and shade moves to the point of its own island or smooth part that is nearest; what
/// the picture slides by is part of the price, so seams and borders of materials stay where they
/// are as long as anything else is cheaper, and hold nothing up for ever. Pieces of two triangles
/// go as a whole when their size is the cheapest.
class MeshCollapser {
 public:
  explicit MeshCollapser(CollapseMesh mesh);

  /// Collapses down to a number of triangles. False: that number cannot be reached.
  bool reduce_to(std::size_t triangles);

  /// Prices by what the mesh is now and less by what it was before: keeps the shape of coarse
  /// levels better, and costs a look at all that is left.
  void forget();

  [[nodiscard]] std::size_t triangles() const { return alive_count_; }
  /// The triangles that are left, in the order in which they came.
  [[nodiscard]] std::vector<CollapseFace> faces() const;
  [[nodiscard]] std::size_t places() const { return places_.size(); }
  /// Where a place is that is a corner of a triangle that is left.
  [[nodiscard]] const glm::dvec3& point_of(std::uint32_t place) const {
    return places_[place].point;
  }
  [[nodiscard]] const CornerLook& look(std::uint32_t number) const { return mesh_.looks[number]; }
  [[nodiscard]] const CornerShade& shade(std::uint32_t number) const {
    return mesh_.shades[number];
  }
  /// Is a triangle of the mesh left? By its number there.
  [[nodiscard]] bool has(std::uint32_t face) const { return alive_[face] != 0; }
  /// The place that a place has become.
  std::uint32_t place_of(std::uint32_t place);

 private:
  /// Queried of a place at once, in two lines of the cache: collapses come from anywhere.
  struct alignas(64) Place {
    Quadric quadric;
    glm::dvec3 point{0.0};
    std::uint32_t first = kNoIndex;  ///< its first corner
    std::uint32_t version = 0;
    std::uint32_t faces = 0;  ///< at it
    bool open = false;        ///< on an edge of one triangle
    bool several = false;     ///< has several looks
  };
  using Corner = FanCorner<std::uint32_t>;
  /// A collapse of `from` into `to`, in its state when it was priced.
  struct Candidate {
    float price = 0;
    std::uint32_t to = 0;
    std::uint32_t from = 0;
    std::uint32_t to_version = 0;
    std::uint32_t from_version = 0;
    /// Dearer first, as a heap has it. Prices are no less than zero: in the order of their bits.
    bool operator<(const Candidate& other) const {
      return key() > other.key() || (key() == other.key() && from > other.from);
    }
    [[nodiscard]] std::uint64_t key() const {
      return std::uint64_t{__builtin_bit_cast(std::uint32_t, price)} << 32 | to;
    }
  };
  /// Where two ends go, and at which price.
  struct Target {
    glm::dvec3 point{0.0};
    double price = 0;
  };
  /// Looks or shades of two places, and that which each becomes: the lowest of those it is joined
  /// with.
  struct JoinedSets {
    std::vector<std::uint32_t> all;
    std::vector<std::uint32_t> slots;  ///< of each look there is: its place in `all`, if it has one
    std::vector<std::uint32_t> parents;  ///< by slot: one that it is joined with, or itself

    void clear();
    void add(std::uint32_t id);
    void join(std::uint32_t a, std::uint32_t b);
    std::uint32_t slot_of_root(std::uint32_t id);
    [[nodiscard]] bool stays(std::size_t slot) const { return parents[slot] == slot; }
  };

  /// Calls back with each triangle at a place, by its corner there, and the two places that follow
  /// it.
  template <class Callback>
  void around(std::uint32_t place, const Callback& callback) {
    visit_fan(places_[place].first, corners_, looks_left_, callback);
  }
  void link_faces();
  [[nodiscard]] std::array<glm::dvec3, 3> corners_of(const CollapseFace& face) const;
  [[nodiscard]] bool is_wide(std::uint32_t a, std::uint32_t b) const {
    return places_[a].faces + places_[b].faces > kWidestCollapse;
  }
  void spend(std::size_t looks) { looks_left_ -= std::min(looks, looks_left_); }
  void remove(std::uint32_t f);
  void add_borders(double weight);
  void settle();
  bool is_open(std::uint32_t place);
  void add_border(std::uint32_t f, std::uint32_t k, double weight);
  void fill_queue(std::size_t collapses);
  [[nodiscard]] Candidate candidate(std::uint32_t a, std::uint32_t b);
  void push_around(std::uint32_t place);
  [[nodiscard]] Target target_of(std::uint32_t a, std::uint32_t b);
  double slide_at(const glm::dvec3& point);
  bool has_several_looks(std::uint32_t place);
  bool has_more(std::uint32_t place, std::uint32_t other) const;
  float loss_of(std::uint32_t a, std::uint32_t b);
  void drop(std::uint32_t place);
  bool folds(std::uint32_t a, std::uint32_t b);
  bool turns(std::uint32_t a, std::uint32_t b, const glm::dvec3& point);
  void collapse(std::uint32_t to, std::uint32_t from, const glm::dvec3& point);
  void collect(std::uint32_t a, std::uint32_t b);
  void join(std::array<std::uint32_t, 3> CollapseFace::*member, JoinedSets& joined);
  struct Nearest;
  Nearest carry_looks(const glm::dvec3& point);
  void carry_corners(const glm::dvec3& point);
  template <class Callback>
  void carry(const glm::dvec3& point, std::array<std::uint32_t, 3> CollapseFace::*member,
             JoinedSets& joined, const Nearest& all, const Callback& callback);

  /// A triangle at one of two places, and which of its corners are there.
  struct NearFace {
    std::uint32_t face = 0;
    std::array<bool, 3> at{};
    /// The first of these. All have one look, and one shade, where they are joined.
    [[nodiscard]] std::size_t first() const { return at[0] ? 0 : at[1] ? 1 : 2; }
  };

  CollapseMesh mesh_;                // its places are in places_
  std::vector<std::uint8_t> alive_;  // of each face
  std::vector<std::uint32_t> left_;  // faces, in order; some of them may be gone
  std::size_t alive_count_ = 0;
  std::size_t looks_left_;
  std::vector<Place> places_;
  std::vector<Corner> corners_;         // three a triangle
  std::vector<std::uint32_t> parents_;  // of each place: what it went to, or itself
  std::vector<std::uint32_t> marks_;
  std::uint32_t mark_ = 0;
  CollapseQueue<Candidate> queue_;
  std::vector<NearFace> near_;
  JoinedSets looks_;
  JoinedSets shades_;
  std::vector<std::pair<double, double>> slides_;  // by slot of a look: a square, an area
  std::vector<std::uint32_t> ring_;
};

}  // namespace modar
