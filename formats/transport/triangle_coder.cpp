#include "formats/transport/triangle_coder.hpp"

#include <algorithm>
#include <cstddef>

#include "formats/base/bits.hpp"

namespace modar {
namespace {

constexpr std::uint32_t kNew = kNoEdge;  ///< a place or vertex that is not coded yet
/// Vertices of a place that are compared before a vertex travels as its number.
constexpr std::uint32_t kMostSearched = 16;

}  // namespace

/// The triangles of an encoder's source by their edges.
class TriangleCoder::Neighbours {
 public:
  explicit Neighbours(const SourceTriangles& source)
      : source_(source), edges_(source.places.size()), done_(source.places.size() / 3) {
    for (std::uint32_t e = 0; e < edges_.size(); ++e) {
      edges_[e] = {key(source.places[e], source.places[next_corner(e)]), e};
    }
    std::sort(edges_.begin(), edges_.end());
    skip_.resize(edges_.size());
  }

  /// A triangle that is not out, in the source's order; there is one.
  std::uint32_t seed() {
    while (done_[seed_] != 0) ++seed_;
    done_[seed_] = 1;
    return 3 * seed_;
  }

  /// An edge from one place to another of a triangle that is not out: with these vertices, if one
  /// of the first few has them. kNoEdge: none.
  std::uint32_t find(std::uint32_t from, std::uint32_t to, std::uint32_t from_vertex,
                     std::uint32_t to_vertex) {
    constexpr std::size_t kFew = 8;
    const std::uint64_t wanted = key(from, to);
    const auto first = static_cast<std::size_t>(
        std::lower_bound(edges_.begin(), edges_.end(), Edge{wanted, 0}) - edges_.begin());
    std::uint32_t found = kNoEdge;
    if (first == edges_.size()) return found;
    std::size_t seen = 0;
    for (std::size_t i = first + skip_[first]; i < edges_.size() && seen < kFew; ++i) {
      if (edges_[i].places != wanted) break;
      const std::uint32_t e = edges_[i].corner;
      if (done_[e / 3] != 0) {
        if (seen == 0) skip_[first] = static_cast<std::uint32_t>(i + 1 - first);
        continue;
      }
      ++seen;
      const bool same =
          source_.vertices[e] == from_vertex && source_.vertices[next_corner(e)] == to_vertex;
      if (found == kNoEdge || same) found = e;
      if (same) break;
    }
    if (found != kNoEdge) done_[found / 3] = 1;
    return found;
  }

 private:
  struct Edge {
    std::uint64_t places;
    std::uint32_t corner;
    bool operator<(const Edge& other) const {
      return places != other.places ? places < other.places : corner < other.corner;
    }
  };
  static std::uint64_t key(std::uint32_t from, std::uint32_t to) {
    return std::uint64_t{from} << 32 | to;
  }

  const SourceTriangles& source_;
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> skip_;  ///< of the first edge of several: how many are out
  std::vector<std::uint8_t> done_;
  std::uint32_t seed_ = 0;
};

TriangleCoder::TriangleCoder(RangeCoder& coder, std::uint32_t triangle_count,
                             std::uint32_t place_count)
    : coder_(coder), count_(triangle_count), numbered_(place_count) {}
TriangleCoder::~TriangleCoder() = default;

CodedTriangles TriangleCoder::encode(const SourceTriangles& source) {
  source_ = source;
  neighbours_ = std::make_unique<Neighbours>(source_);
  const auto numbers = [](std::span<const std::uint16_t> of) {
    return of.empty() ? 0u : *std::max_element(of.begin(), of.end()) + 1u;
  };
  coded_places_.assign(numbers(source.places), kNew);
  coded_vertices_.assign(numbers(source.vertices), kNew);
  run();
  return std::move(out_);
}

std::optional<CodedTriangles> TriangleCoder::decode(std::uint32_t most_vertices) {
  most_vertices_ = most_vertices;
  run();
  if (bad()) return std::nullopt;
  return std::move(out_);
}

void TriangleCoder::run() {
  const std::size_t corners = std::size_t{3} * count_;
  out_.places.resize(corners);
  out_.vertices.resize(corners);
  out_.opposite.assign(corners, kNoEdge);
  before_.resize(corners);
  after_.resize(corners);
  open_.resize(corners);
  while (coded_ < count_ && !bad()) {
    code_seed();
    while (crossed_ < queue_.size() && coded_ < count_ && !bad()) {
      const std::uint32_t edge = queue_[crossed_++];
      if (open_[edge] != 0) cross(edge);
    }
  }
}

std::uint32_t TriangleCoder::wanted_place(std::size_t k) const {
  return neighbours_ == nullptr ? kNew : coded_places_[source_.places[corners_[k]]];
}

std::uint32_t TriangleCoder::wanted_vertex(std::size_t k) const {
  return neighbours_ == nullptr ? kNew : coded_vertices_[source_.vertices[corners_[k]]];
}

/// A triangle next to none that is known.
void TriangleCoder::code_seed() {
  const std::uint32_t first = 3 * coded_++;
  if (neighbours_ != nullptr) {
    const std::uint32_t corner = neighbours_->seed();
    corners_ = {corner, corner + 1, corner + 2};
  }
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t corner = first + k;
    if (out_.place_count == 0 || coder_.code(wanted_place(k) == kNew, seeds_[k])) {
      add_place(corner, k == 0 ? kNoEdge : corner - 1);
    } else {
      know_place(corner);
      if (bad()) return;
      code_vertex(corner, newest_vertex_[out_.places[corner]], kNew, 3);
    }
    if (bad()) return;
  }
  count_triangle(first);
  for (std::uint32_t k = 0; k < 3; ++k) link(first + k, first + (k + 1) % 3);
  for (std::uint32_t k = 0; k < 3; ++k) open(first + k);
}

TriangleCoder::EdgeModel& TriangleCoder::model_of(std::uint32_t edge) {
  const std::size_t degrees =
      std::size_t{degree_[out_.places[edge]]} * 8 + degree_[out_.places[next_corner(edge)]];
  return edges_[degrees * 4 + open_[before_[edge]] * std::size_t{2} + open_[after_[edge]]];
}

void TriangleCoder::cross(std::uint32_t edge) {
  EdgeModel& model = model_of(edge);
  open_[edge] = 0;
  std::uint32_t third = kNew;
  if (code_border(edge, model, third)) return;
  Crossing crossing{edge, before_[edge], after_[edge], 3 * coded_++};
  out_.places[crossing.first] = out_.places[next_corner(edge)];
  out_.places[crossing.first + 1] = out_.places[edge];
  out_.opposite[crossing.first] = edge;
  out_.opposite[edge] = crossing.first;
  code_third(crossing, model, third);
  if (bad()) return;
  code_corners(crossing);
  if (bad()) return;
  count_triangle(crossing.first);
  link_border(crossing);
}

/// Whether there is no triangle. third: an encoder's place of the third corner.
bool TriangleCoder::code_border(std::uint32_t edge, EdgeModel& model, std::uint32_t& third) {
  bool border = false;
  if (neighbours_ != nullptr) {
    const std::uint32_t end = next_corner(edge);
    const std::uint32_t found = neighbours_->find(
        out_.source_places[out_.places[end]], out_.source_places[out_.places[edge]],
        out_.source_vertices[out_.vertices[end]], out_.source_vertices[out_.vertices[edge]]);
    border = found == kNoEdge;
    if (!border) {
      corners_ = {found, next_corner(found), last_corner(found)};
      third = wanted_place(2);
    }
  }
  return coder_.code(border, model.border);
}

void TriangleCoder::code_third(Crossing& crossing, EdgeModel& model, std::uint32_t wanted) {
  const std::uint32_t corner = crossing.first + 2;
  crossing.fresh = coder_.code(wanted == kNew, model.fresh);
  if (crossing.fresh) return;
  const std::uint32_t start = out_.places[crossing.before];
  const std::uint32_t end = out_.places[next_corner(crossing.after)];
  if (open_[crossing.before] != 0)
    crossing.joins_before = coder_.code(wanted == start, model.before);
  if (open_[crossing.after] != 0) {
    crossing.joins_after =
        crossing.joins_before ? start == end : coder_.code(wanted == end, model.after);
  }
  if (crossing.joins_before) {
    out_.places[corner] = start;
  } else if (crossing.joins_after) {
    out_.places[corner] = end;
  } else {
    know_place(corner);
  }
}

/// Which of their places' vertices the three corners have: most often those of the neighbours.
void TriangleCoder::code_corners(const Crossing& c) {
  const auto& vertices = out_.vertices;
  const std::uint32_t before = c.joins_before ? vertices[c.before] : kNew;
  const std::uint32_t after = c.joins_after ? vertices[next_corner(c.after)] : kNew;
  code_vertex(c.first, vertices[next_corner(c.edge)], c.joins_after ? vertices[c.after] : kNew,
              c.joins_after ? 1 : 0);
  code_vertex(c.first + 1, vertices[c.edge],
              c.joins_before ? vertices[next_corner(c.before)] : kNew, c.joins_before ? 1 : 0);
  const std::uint32_t third = c.first + 2;
  if (c.fresh) {
    add_place(third, c.first + 1);
  } else if (c.joins_before) {
    code_vertex(third, before, after, 2);
  } else {
    code_vertex(third, c.joins_after ? after : newest_vertex_[out_.places[third]], kNew, 2);
  }
}

void TriangleCoder::count_triangle(std::uint32_t first) {
  for (std::uint32_t k = 0; k < 3; ++k) {
    std::uint8_t& degree = degree_[out_.places[first + k]];
    degree = static_cast<std::uint8_t>(std::min(degree + 1, 7));
  }
}

/// The triangle's other edges are open now, but for those that meet an open one.
void TriangleCoder::link_border(const Crossing& c) {
  const std::uint32_t to_third = c.first + 1;
  const std::uint32_t from_third = c.first + 2;
  const auto close = [&](std::uint32_t edge, std::uint32_t own) {
    open_[edge] = 0;
    out_.opposite[edge] = own;
    out_.opposite[own] = edge;
  };
  if (c.joins_before) close(c.before, to_third);
  if (c.joins_after) close(c.after, from_third);
  if (c.joins_before && c.joins_after) {
    if (before_[c.before] != c.after) link(before_[c.before], after_[c.after]);
  } else if (c.joins_before) {
    link(before_[c.before], from_third);
    link(from_third, c.after);
    open(from_third);
  } else if (c.joins_after) {
    link(c.before, to_third);
    link(to_third, after_[c.after]);
    open(to_third);
  } else {
    const std::uint32_t other = c.fresh ? kNoEdge : start_[out_.places[c.first + 2]];
    const bool splits = other != kNoEdge && open_[other] != 0;
    const std::uint32_t before_other = splits ? before_[other] : to_third;
    link(c.before, to_third);
    if (splits) link(to_third, other);
    link(before_other, from_third);
    link(from_third, c.after);
    open(to_third);
    open(from_third);
  }
}

void TriangleCoder::link(std::uint32_t before, std::uint32_t after) {
  after_[before] = after;
  before_[after] = before;
}

void TriangleCoder::open(std::uint32_t edge) {
  open_[edge] = 1;
  start_[out_.places[edge]] = edge;
  queue_.push_back(edge);
}

/// likely, other: vertices of the corner's place, or kNew for none. kind: of what neighbours they
/// are, below 4.
void TriangleCoder::code_vertex(std::uint32_t corner, std::uint32_t likely, std::uint32_t other,
                                std::size_t kind) {
  if (numbered_ != 0) {
    out_.vertices[corner] = out_.places[corner];
    return;
  }
  const std::uint32_t wanted = wanted_vertex(corner % 3);
  if (coder_.code(wanted == likely, vertices_[kind][0])) {
    out_.vertices[corner] = likely;
  } else if (other != kNew && other != likely && coder_.code(wanted == other, vertices_[kind][1])) {
    out_.vertices[corner] = other;
  } else if (!search_vertex(corner, wanted, likely, other)) {
    add_vertex(corner);
  }
}

/// Whether it is a known vertex of the corner's place.
bool TriangleCoder::search_vertex(std::uint32_t corner, std::uint32_t wanted, std::uint32_t likely,
                                  std::uint32_t other) {
  std::size_t searched = 0;
  std::uint32_t vertex = newest_vertex_[out_.places[corner]];
  for (; vertex != kNew && searched < kMostSearched; vertex = older_vertex_[vertex]) {
    if (vertex == likely || vertex == other) continue;
    out_.vertices[corner] = vertex;
    if (coder_.code(wanted == vertex, searches_[searched++])) return true;
  }
  if (vertex == kNew || coder_.code(wanted == kNew, searches_[kMostSearched])) return false;
  const std::uint32_t number =
      coder_.code_bits(wanted, bit_width(std::uint64_t{out_.vertex_count} - 1));
  failed_ = failed_ || number >= out_.vertex_count;
  out_.vertices[corner] = failed_ ? 0 : number;
  return true;
}

void TriangleCoder::add_vertex(std::uint32_t corner) {
  const std::uint32_t place = out_.places[corner];
  if (out_.vertex_count == most_vertices_) {
    failed_ = true;
    return;
  }
  out_.vertices[corner] = out_.vertex_count++;
  older_vertex_.push_back(newest_vertex_[place]);
  newest_vertex_[place] = out_.vertices[corner];
  if (neighbours_ == nullptr) return;
  const std::uint32_t vertex = source_.vertices[corners_[corner % 3]];
  coded_vertices_[vertex] = out_.vertices[corner];
  out_.source_vertices.push_back(vertex);
}

/// near: a corner at whose place's number the new one's is likely, or kNoEdge.
void TriangleCoder::add_place(std::uint32_t corner, std::uint32_t near) {
  out_.places[corner] = out_.place_count++;
  degree_.push_back(0);
  start_.push_back(kNoEdge);
  newest_vertex_.push_back(kNew);
  std::uint32_t number = 0;
  if (neighbours_ != nullptr) {
    number = source_.places[corners_[corner % 3]];
    coded_places_[number] = out_.places[corner];
  }
  if (numbered_ != 0) {
    const std::uint32_t from = near == kNoEdge ? 0 : out_.source_places[out_.places[near]];
    number = code_number(number, from);
  }
  out_.source_places.push_back(number);
  add_vertex(corner);
}

void TriangleCoder::know_place(std::uint32_t corner) {
  const std::uint32_t wanted = wanted_place(corner % 3);
  out_.places[corner] = coder_.code_bits(wanted, bit_width(std::uint64_t{out_.place_count} - 1));
  if (out_.places[corner] < out_.place_count) return;
  failed_ = true;
  out_.places[corner] = 0;
}

/// By its distance from another: the sign, the count of bits, the bits.
std::uint32_t TriangleCoder::code_number(std::uint32_t number, std::uint32_t near) {
  const bool below = coder_.code(number < near, number_sign_);
  const std::uint32_t distance = below ? near - number : number - near;
  const int wanted = bit_width(distance);
  int width = 0;
  while (width < 17 &&
         coder_.code(wanted > width, number_sizes_[static_cast<std::size_t>(width)])) {
    ++width;
  }
  std::uint32_t coded = 0;
  if (width > 0) coded = 1u << (width - 1) | coder_.code_bits(distance, width - 1);
  const std::uint32_t answer = below ? near - coded : near + coded;
  if (answer < numbered_) return answer;
  failed_ = true;
  return 0;
}

}  // namespace modar
