// Prices edges, collapses them, and carries looks and shades along.
#include "bake/mesh/lod/mesh_collapse.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include <glm/geometric.hpp>

#include "bake/mesh/rays/triangle_tree.hpp"

namespace modar {
namespace {

/// Weight of the squared texture shift against the surface's squared error. Higher keeps textures
/// in place. [0.5, 2]
constexpr double kSlideWeight = 1.0;
/// Distance, in edge lengths, of the least point of the quadrics from the edge's middle. Limits
/// drift where planes are nearly parallel. [0.75, 3]
constexpr double kFarthest = 1.5;
/// Share of the old quadrics kept when prices are recomputed. Lower shrinks thin parts, higher
/// distorts smooth surfaces. [0.3, 0.6]
constexpr double kQuadricMemory = 0.5;
/// Weight of the distance from a quadric's least point, against that from its planes. Higher holds
/// points where planes are nearly parallel.
constexpr double kPull = 0.001;
/// What a candidate of the queue costs, in looks at triangles.
constexpr std::size_t kLooksACandidate = 16;

}  // namespace

void MeshCollapser::JoinedSets::clear() {
  for (const std::uint32_t id : all) slots[id] = kNoIndex;
  all.clear();
  parents.clear();
}

void MeshCollapser::JoinedSets::add(std::uint32_t id) {
  if (slots[id] != kNoIndex) return;
  slots[id] = static_cast<std::uint32_t>(all.size());
  parents.push_back(slots[id]);
  all.push_back(id);
}

std::uint32_t MeshCollapser::JoinedSets::slot_of_root(std::uint32_t id) {
  std::uint32_t slot = slots[id];
  while (parents[slot] != slot) slot = parents[slot] = parents[parents[slot]];
  return slot;
}

void MeshCollapser::JoinedSets::join(std::uint32_t a, std::uint32_t b) {
  a = slot_of_root(a);
  b = slot_of_root(b);
  (all[a] < all[b] ? parents[b] : parents[a]) = all[a] < all[b] ? a : b;
}

MeshCollapser::MeshCollapser(CollapseMesh mesh)
    : mesh_(std::move(mesh)),
      alive_(mesh_.faces.size(), 1),
      left_(mesh_.faces.size()),
      alive_count_(mesh_.faces.size()),
      looks_left_(kMeshLooksATriangle * mesh_.faces.size()),
      places_(mesh_.places.size()),
      corners_(3 * mesh_.faces.size()),
      parents_(mesh_.places.size()),
      marks_(mesh_.places.size(), 0) {
  std::iota(parents_.begin(), parents_.end(), 0u);
  std::iota(left_.begin(), left_.end(), 0u);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    places_[i].point = mesh_.places[i];
    places_[i].quadric = mesh_.quadrics[i];
  }
  mesh_.places = {};
  mesh_.quadrics = {};
  looks_.slots.assign(mesh_.looks.size(), kNoIndex);
  shades_.slots.assign(mesh_.shades.size(), kNoIndex);
  link_faces();
  add_borders(1.0);
  settle();
  forget();
}

void MeshCollapser::link_faces() {
  for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
    const auto& at = mesh_.faces[f].places;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t corner = 3 * f + k;
      const std::array<std::uint32_t, 2>& others = kOtherCorners[k];
      ++places_[at[k]].faces;
      corners_[corner] = {std::exchange(places_[at[k]].first, corner), at[others[0]],
                          at[others[1]]};
    }
  }
  for (std::uint32_t place = 0; place < places_.size(); ++place) {
    places_[place].several = has_several_looks(place);
    places_[place].open = is_open(place);
  }
}

std::array<glm::dvec3, 3> MeshCollapser::corners_of(const CollapseFace& face) const {
  const auto& at = face.places;
  return {places_[at[0]].point, places_[at[1]].point, places_[at[2]].point};
}

void MeshCollapser::remove(std::uint32_t f) {
  for (std::uint32_t k = 0; k < 3; ++k) corners_[3 * f + k].leave();
  for (const std::uint32_t place : mesh_.faces[f].places) --places_[place].faces;
  alive_[f] = 0;
  --alive_count_;
}

void MeshCollapser::forget() {
  queue_.clear();
  std::erase_if(left_, [&](std::uint32_t f) { return alive_[f] == 0; });
  ++mark_;
  for (const std::uint32_t f : left_) {
    const auto& [a, b, c] = mesh_.faces[f].places;
    Quadric plane = Quadric::of_triangle(point_of(a), point_of(b), point_of(c));
    plane *= 1 - kQuadricMemory;
    for (const std::uint32_t place : {a, b, c}) {
      Quadric& quadric = places_[place].quadric;
      if (std::exchange(marks_[place], mark_) != mark_) quadric *= kQuadricMemory;
      quadric += plane;
    }
  }
  // Collapses create no new border.
  for (std::uint32_t place = 0; place < places_.size(); ++place) {
    places_[place].open = places_[place].open && is_open(place);
  }
  add_borders(1 - kQuadricMemory);
}

/// Adds the planes across the borders of the remaining mesh.
void MeshCollapser::add_borders(double weight) {
  for (const std::uint32_t f : left_) {
    const std::array<std::uint32_t, 3>& at = mesh_.faces[f].places;
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (places_[at[k]].open && places_[at[(k + 1) % 3]].open) add_border(f, k, weight);
    }
  }
}

/// Is some edge at a place one of a single triangle?
bool MeshCollapser::is_open(std::uint32_t place) {
  // Marks of the neighbourhood of the place: mark_ - 1 in one triangle, mark_ in several.
  mark_ += 2;
  int single = 0;
  around(place, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) {
    for (const std::uint32_t other : {a, b}) {
      std::uint32_t& mark = marks_[other];
      if (mark == mark_) continue;
      single += mark == mark_ - 1 ? -1 : 1;
      mark = mark == mark_ - 1 ? mark_ : mark_ - 1;
    }
  });
  return single > 0;
}

/// A plane through an edge of one triangle, across it.
void MeshCollapser::add_border(std::uint32_t f, std::uint32_t k, double weight) {
  const std::array<std::uint32_t, 3>& at = mesh_.faces[f].places;
  const std::uint32_t v = at[k];
  const std::uint32_t w = at[(k + 1) % 3];
  if (is_wide(v, w)) return;
  std::size_t count = 0;
  around(v, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) { count += a == w || b == w; });
  if (count != 1) return;
  const Quadric plane =
      Quadric::of_border(point_of(v), point_of(w), point_of(at[(k + 2) % 3]), weight);
  places_[v].quadric += plane;
  places_[w].quadric += plane;
}

std::uint32_t MeshCollapser::place_of(std::uint32_t place) {
  std::uint32_t root = place;
  while (parents_[root] != root) root = parents_[root];
  while (parents_[place] != root) place = std::exchange(parents_[place], root);
  return root;
}

std::vector<CollapseFace> MeshCollapser::faces() const {
  std::vector<CollapseFace> left;
  left.reserve(alive_count_);
  for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
    if (alive_[f] != 0) left.push_back(mesh_.faces[f]);
  }
  return left;
}

bool MeshCollapser::reduce_to(std::size_t triangles) {
  bool collapsed = true;
  while (alive_count_ > triangles) {
    if (looks_left_ == 0) return false;
    if (queue_.empty()) {
      // Collapses that were not legal before may be legal now.
      if (!collapsed) return false;
      collapsed = false;
      fill_queue(alive_count_ - triangles);
      continue;
    }
    const Candidate best = queue_.take();
    if (best.to_version != places_[best.to].version ||
        best.from_version != places_[best.from].version) {
      continue;
    }
    if (const float price = loss_of(best.to, best.from); price > 0) {
      if (price <= best.price) {
        drop(best.to);
        collapsed = true;
      } else {
        queue_.push({price, best.to, best.from, best.to_version, best.from_version});
      }
      continue;
    }
    const glm::dvec3 point = target_of(best.to, best.from).point;
    if (folds(best.to, best.from) || turns(best.to, best.from, point)) continue;
    collapse(best.to, best.from, point);
    collapsed = true;
  }
  return true;
}

/// collapses: about this many will follow.
void MeshCollapser::fill_queue(std::size_t collapses) {
  std::vector<Candidate> all;
  all.reserve(2 * alive_count_);
  for (const std::uint32_t f : left_) {
    if (alive_[f] == 0) continue;
    const auto at = mesh_.faces[f].places;
    // From one of its two triangles; at a border and where they are turned, from any.
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = at[k];
      const std::uint32_t b = at[(k + 1) % 3];
      if (is_wide(a, b)) continue;
      if (a < b || (places_[a].open && places_[b].open)) all.push_back(candidate(a, b));
    }
  }
  queue_.fill(std::move(all), collapses);
}

MeshCollapser::Candidate MeshCollapser::candidate(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t to = std::min(a, b);
  const std::uint32_t from = std::max(a, b);
  const auto price = static_cast<float>(target_of(to, from).price);
  spend(kLooksACandidate);
  return {price, to, from, places_[to].version, places_[from].version};
}

void MeshCollapser::push_around(std::uint32_t place) {
  ring_.clear();
  ++mark_;
  around(place, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) {
    for (const std::uint32_t other : {a, b}) {
      if (std::exchange(marks_[other], mark_) != mark_) ring_.push_back(other);
    }
  });
  for (const std::uint32_t other : ring_) {
    if (!is_wide(place, other)) queue_.push(candidate(place, other));
  }
}

bool MeshCollapser::has_several_looks(std::uint32_t place) {
  std::uint32_t seen = kNoIndex;
  bool several = false;
  around(place, [&](std::uint32_t corner, std::uint32_t, std::uint32_t) {
    const std::uint32_t look = mesh_.faces[corner / 3].looks[corner % 3];
    several = several || (seen != kNoIndex && look != seen);
    seen = look;
  });
  return several;
}

MeshCollapser::Target MeshCollapser::target_of(std::uint32_t a, std::uint32_t b) {
  Quadric sum = places_[a].quadric;
  sum += places_[b].quadric;
  const glm::dvec3& pa = point_of(a);
  const glm::dvec3& pb = point_of(b);
  const glm::dvec3 middle = 0.5 * (pa + pb);
  std::array<glm::dvec3, 4> points = {pa, pb, middle};
  std::size_t count = 3;
  if (sum.least(points[3])) {
    const glm::dvec3 off = points[3] - middle;
    const glm::dvec3 edge = pb - pa;
    if (glm::dot(off, off) <= kFarthest * kFarthest * glm::dot(edge, edge)) count = 4;
  }
  const bool slides = places_[a].several || places_[b].several;
  if (slides) collect(a, b);
  Target best;
  best.price = std::numeric_limits<double>::infinity();
  for (std::size_t i = count; i-- > 0;) {
    double price = std::max(0.0, sum.at(points[i]));
    if (slides && price < best.price) price += kSlideWeight * slide_at(points[i]);
    if (price < best.price) best = {points[i], price};
    // No other has a lower one.
    if (i == 3 && !slides) break;
  }
  if (sum.area > 0) best.price /= std::sqrt(sum.area);
  return best;
}

/// The triangles at two places, or at one, with the looks and shades there that become one: those
/// that a triangle between the places has at both.
void MeshCollapser::collect(std::uint32_t a, std::uint32_t b) {
  near_.clear();
  const std::array<std::uint32_t, 2> places = {a, b};
  for (const std::uint32_t place : std::span(places).first(a == b ? 1 : 2)) {
    around(place, [&](std::uint32_t corner, std::uint32_t c, std::uint32_t d) {
      if (place == b && (c == a || d == a)) return;
      const std::uint32_t f = corner / 3;
      const auto& at = mesh_.faces[f].places;
      NearFace near{f, {}};
      for (std::size_t k = 0; k < 3; ++k) near.at[k] = at[k] == a || at[k] == b;
      near_.push_back(near);
    });
  }
  join(&CollapseFace::looks, looks_);
  join(&CollapseFace::shades, shades_);
}

void MeshCollapser::join(std::array<std::uint32_t, 3> CollapseFace::*member, JoinedSets& joined) {
  joined.clear();
  for (const NearFace& near : near_) {
    const auto& ids = mesh_.faces[near.face].*member;
    std::uint32_t before = kNoIndex;
    for (std::size_t k = 0; k < 3; ++k) {
      if (!near.at[k]) continue;
      joined.add(ids[k]);
      if (before != kNoIndex) joined.join(before, ids[k]);
      before = ids[k];
    }
  }
}

/// Squares of what the pictures slide by at a point, by the areas of the triangles of each look: it
/// is beyond them by so much. Of collect().
double MeshCollapser::slide_at(const glm::dvec3& point) {
  spend(near_.size());
  slides_.assign(looks_.all.size(), {std::numeric_limits<double>::infinity(), 0.0});
  for (const NearFace& near : near_) {
    const CollapseFace& face = mesh_.faces[near.face];
    auto& [square, area] = slides_[looks_.slot_of_root(face.looks[near.first()])];
    const std::array<glm::dvec3, 3> t = corners_of(face);
    square = std::min(square, distance_square(point, t, square));
    area += 0.5 * glm::length(glm::cross(t[1] - t[0], t[2] - t[0]));
  }
  double sum = 0;
  for (std::size_t slot = 0; slot < slides_.size(); ++slot) {
    if (looks_.stays(slot)) sum += slides_[slot].second * slides_[slot].first;
  }
  return sum;
}

/// Has a place a triangle without another one?
bool MeshCollapser::has_more(std::uint32_t place, std::uint32_t other) const {
  for (std::uint32_t at = places_[place].first; at != kNoIndex; at = corners_[at].next) {
    const Corner& corner = corners_[at];
    if (!corner.is_gone() && corner.a != other && corner.b != other) return true;
  }
  return false;
}

/// What it costs that a piece of one or two triangles goes as a whole, as all of it is at one edge:
/// it is off by its length. 0: there is more.
float MeshCollapser::loss_of(std::uint32_t a, std::uint32_t b) {
  if (has_more(a, b) || has_more(b, a)) return 0.0f;
  double area = 0;
  double square = 0;
  around(a, [&](std::uint32_t corner, std::uint32_t, std::uint32_t) {
    const std::array<glm::dvec3, 3> t = corners_of(mesh_.faces[corner / 3]);
    area += 0.5 * glm::length(glm::cross(t[1] - t[0], t[2] - t[0]));
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 side = t[(k + 1) % 3] - t[k];
      square = std::max(square, glm::dot(side, side));
    }
  });
  constexpr float kMinWeight = std::numeric_limits<float>::min();
  return std::max(kMinWeight, static_cast<float>(std::sqrt(area) * square));
}

void MeshCollapser::drop(std::uint32_t place) {
  around(place, [&](std::uint32_t corner, std::uint32_t, std::uint32_t) { remove(corner / 3); });
}

/// Have two places other common neighbours than those of the triangles between them? Then the
/// surface would fold onto itself.
bool MeshCollapser::folds(std::uint32_t a, std::uint32_t b) {
  ++mark_;
  ring_.clear();
  around(a, [&](std::uint32_t, std::uint32_t c, std::uint32_t d) {
    marks_[c] = marks_[d] = mark_;
    if (c != b && d != b) return;
    const std::uint32_t third = c == b ? d : c;
    if (std::find(ring_.begin(), ring_.end(), third) == ring_.end()) ring_.push_back(third);
  });
  std::size_t common = 0;
  marks_[b] = 0;
  around(b, [&](std::uint32_t, std::uint32_t c, std::uint32_t d) {
    for (const std::uint32_t other : {c, d}) {
      if (marks_[other] != mark_) continue;
      marks_[other] = 0;
      ++common;
    }
  });
  return ring_.empty() || common != ring_.size();
}

/// Would a triangle that stays turn too far, or lose its area?
bool MeshCollapser::turns(std::uint32_t a, std::uint32_t b, const glm::dvec3& point) {
  bool found = false;
  for (const std::uint32_t place : {a, b}) {
    const glm::dvec3& from = point_of(place);
    around(place, [&](std::uint32_t, std::uint32_t c, std::uint32_t d) {
      if (found || c == a || d == a || c == b || d == b) return;
      found = turns_too_far(point_of(c), point_of(d), from, point);
    });
  }
  return found;
}

void MeshCollapser::collapse(std::uint32_t to, std::uint32_t from, const glm::dvec3& point) {
  collect(to, from);
  carry_corners(point);
  for (const NearFace& near : near_) {
    CollapseFace& face = mesh_.faces[near.face];
    if (near.at[0] + near.at[1] + near.at[2] > 1) {
      remove(near.face);
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      if (!near.at[k]) continue;
      face.places[k] = to;
      face.looks[k] = looks_.all[looks_.slot_of_root(face.looks[k])];
      face.shades[k] = shades_.all[shades_.slot_of_root(face.shades[k])];
      const std::array<std::uint32_t, 2>& others = kOtherCorners[k];
      corners_[3 * near.face + others[0]].b = to;
      corners_[3 * near.face + others[1]].a = to;
    }
  }
  Place& kept = places_[to];
  Place& gone = places_[from];
  std::uint32_t* end = &kept.first;
  while (*end != kNoIndex) end = &corners_[*end].next;
  *end = std::exchange(gone.first, kNoIndex);
  kept.point = point;
  kept.quadric += gone.quadric;
  kept.open = kept.open || gone.open;
  kept.faces += gone.faces;
  if (kept.several || gone.several) kept.several = has_several_looks(to);
  parents_[from] = to;
  ++kept.version;
  ++gone.version;
  push_around(to);
}

/// The nearest point of some triangles, and which one it is on.
struct MeshCollapser::Nearest {
  ClosestPoint closest{std::numeric_limits<double>::infinity(), 0, 0};
  const CollapseFace* face = nullptr;

  void consider(const CollapseFace& other, const std::array<glm::dvec3, 3>& corners,
                const glm::dvec3& point) {
    const ClosestPoint found = closest_point(point, corners);
    if (found.square < closest.square) *this = {found, &other};
  }
  [[nodiscard]] std::array<double, 3> weights() const {
    return {1 - closest.b - closest.c, closest.b, closest.c};
  }
};

/// Calls back with each remaining look or shade, and the nearest point that takes it over: of the
/// triangles of collect() that have it. all: the nearest of all of them.
template <class Callback>
void MeshCollapser::carry(const glm::dvec3& point,
                          std::array<std::uint32_t, 3> CollapseFace::*member, JoinedSets& joined,
                          const Nearest& all, const Callback& callback) {
  std::size_t staying = 0;
  for (std::size_t slot = 0; slot < joined.all.size(); ++slot) staying += joined.stays(slot);
  // All triangles have the only one.
  std::vector<Nearest> nearest(joined.all.size(), staying == 1 ? all : Nearest());
  for (const NearFace& near : near_) {
    if (staying == 1) break;
    const CollapseFace& face = mesh_.faces[near.face];
    nearest[joined.slot_of_root((face.*member)[near.first()])].consider(face, corners_of(face),
                                                                        point);
  }
  for (std::size_t slot = 0; slot < nearest.size(); ++slot) {
    if (joined.stays(slot)) callback(joined.all[slot], nearest[slot]);
  }
}

MeshCollapser::Nearest MeshCollapser::carry_looks(const glm::dvec3& point) {
  Nearest all;
  for (const NearFace& near : near_) {
    const CollapseFace& face = mesh_.faces[near.face];
    all.consider(face, corners_of(face), point);
  }
  carry(point, &CollapseFace::looks, looks_, all, [&](std::uint32_t root, const Nearest& nearest) {
    CornerLook sum;
    const std::array<double, 3> weights = nearest.weights();
    for (std::size_t k = 0; k < 3; ++k) {
      const CornerLook& corner = mesh_.looks[nearest.face->looks[k]];
      sum.uv += weights[k] * corner.uv;
      sum.colour += static_cast<float>(weights[k]) * corner.colour;
    }
    mesh_.looks[root] = sum;
  });
  return all;
}

void MeshCollapser::carry_corners(const glm::dvec3& point) {
  const Nearest all = carry_looks(point);
  carry(point, &CollapseFace::shades, shades_, all,
        [&](std::uint32_t root, const Nearest& nearest) {
          CornerShade sum;
          const std::array<double, 3> weights = nearest.weights();
          for (std::size_t k = 0; k < 3; ++k) {
            const CornerShade& corner = mesh_.shades[nearest.face->shades[k]];
            sum.normal += static_cast<float>(weights[k]) * corner.normal;
            sum.occlusion += static_cast<float>(weights[k]) * corner.occlusion;
          }
          const float length = glm::length(sum.normal);
          sum.normal = length > 0 ? sum.normal / length : mesh_.shades[root].normal;
          mesh_.shades[root] = sum;
        });
}

/// Moves each place to where its quadric is least, if no triangle turns: half-edge collapses have
/// left it where it was. Shades stay: a blend of those around is no nearer to what level 0 has
/// there.
void MeshCollapser::settle() {
  for (std::uint32_t place = 0; place < places_.size(); ++place) {
    Place& at = places_[place];
    if (at.first == kNoIndex || is_wide(place, place)) continue;
    const glm::dvec3 point = at.quadric.least_near(at.point, kPull);
    bool turned = false;
    around(place, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) {
      turned = turned || turns_too_far(point_of(a), point_of(b), at.point, point);
    });
    if (turned) continue;
    collect(place, place);
    carry_looks(point);
    at.point = point;
  }
}

}  // namespace modar
