// Normals from faces: weighted sums of the faces around a position, split at sharp edges.
#include "bake/mesh/weld/normals.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

namespace modar {
namespace {

/// Pairs of faces compared at one edge; edges with more stay sharp, which bounds the time.
constexpr std::size_t kMostPairs = 64;
/// Share of creased vertices where a crease ends, above which creases are noise. Higher keeps scans
/// rough, lower smooths modelled shapes. [0.16, 0.23]
constexpr double kNoise = 0.2;
/// The same where most vertices of a large mesh are creased: boxes have 0, rough scans from 0.015.
constexpr double kRoughNoise = 0.01;
constexpr std::uint64_t kManyCreased = 10'000;
/// Creased vertices below which neither says anything.
constexpr std::uint64_t kFewCreased = 64;
/// Cosine by which rounded coordinates may differ: a cylinder of 9 sides is round at 40 degrees.
constexpr double kRounding = 1e-4;
constexpr double kDegree = 3.141592653589793 / 180;

/// Two doubles in one register, with the operators of one.
using Pair = double __attribute__((vector_size(16)));

/// atan2(sine, cosine) for sines of 0 or more, off by 2e-8 at most (Abramowitz and Stegun, 4.4.49):
/// a weight needs no more, and libm's took a tenth of the bake of a scan without normals. Without
/// branches, which random angles would mispredict.
Pair angles_of(Pair sine, Pair cosine) {
  const Pair width = cosine < 0.0 ? -cosine : cosine;
  const Pair greater = sine < width ? width : sine;
  const Pair lesser = width < sine ? width : sine;
  const Pair x = lesser / greater;
  const Pair s = x * x;
  Pair angle = s * 0.0028662257 + -0.0161657367;
  for (const double factor : {0.0429096138, -0.0752896400, 0.1065626393, -0.1420889944,
                              0.1999355085, -0.3333314528, 1.0}) {
    angle = angle * s + factor;
  }
  angle *= x;
  constexpr double kPi = 3.141592653589793;
  angle = sine > width ? kPi / 2 - angle : angle;
  angle = cosine < 0.0 ? kPi - angle : angle;
  return greater > 0.0 ? angle : greater;
}

/// What corners add to normals: the face's area vector times the angle at the corner, so that
/// neither thin nor many triangles of one flat side tilt the normal (Max, "Weights for computing
/// vertex normals from facet normals", 1999, for the area; Thuermer and Wuethrich, 1998, for the
/// angle). Many corners at a time, two angles in one instruction.
class CornerShares {
 public:
  explicit CornerShares(Array<glm::dvec3>& sums) : sums_(sums) {}
  CornerShares(const CornerShares&) = delete;
  CornerShares& operator=(const CornerShares&) = delete;
  ~CornerShares() { flush(); }

  void add(std::uint32_t node, const glm::dvec3& area, double sine, double cosine) {
    if (count_ == kMost) flush();
    node_[count_] = node;
    area_[count_] = area;
    sine_[count_] = sine;
    cosine_[count_++] = cosine;
  }

 private:
  /// What they need fills half of a first-level cache.
  static constexpr std::size_t kMost = 384;

  void flush() {
    for (std::size_t i = 0; i < count_; i += 2) {
      Pair sine;
      Pair cosine;
      std::memcpy(&sine, &sine_[i], sizeof sine);
      std::memcpy(&cosine, &cosine_[i], sizeof cosine);
      const Pair angle = angles_of(sine, cosine);
      std::memcpy(&sine_[i], &angle, sizeof angle);
    }
    for (std::size_t i = 0; i < count_; ++i) sums_[node_[i]] += area_[i] * sine_[i];
    count_ = 0;
  }

  Array<glm::dvec3>& sums_;
  std::size_t count_ = 0;
  std::array<std::uint32_t, kMost> node_{};
  std::array<glm::dvec3, kMost> area_{};
  std::array<double, kMost> sine_{};  // times the lengths of the two sides, as the cosines are
  std::array<double, kMost> cosine_{};
};

glm::vec3 normal_of(const glm::dvec3& sum) {
  const double length = glm::length(sum);
  return glm::vec3(length > 0 && std::isfinite(length) ? sum / length : glm::dvec3(0, 0, 1));
}

/// Normals of sums, in the memory of the sums.
Array<glm::vec3> to_normals(Array<glm::dvec3>&& sums) {
  const std::size_t count = sums.size();
  auto* const bytes = reinterpret_cast<unsigned char*>(sums.data());
  for (std::size_t v = 0; v < count; ++v) {
    const glm::vec3 normal = normal_of(sums[v]);
    // Ends where the next sum begins, or before.
    std::memcpy(bytes + v * sizeof normal, &normal, sizeof normal);
  }
  Array<glm::vec3> normals = Array<glm::vec3>::split(std::move(sums));
  normals.resize(count);
  normals.shrink();
  return normals;
}

/// A corner at a node, and the positions before and after it in its face.
struct FanCorner {
  std::uint32_t corner = 0;
  std::uint32_t face = 0;
  std::uint32_t before = 0;
  std::uint32_t after = 0;
  glm::dvec3 share{0.0};
  glm::dvec3 normal{0.0};  // of the face, of unit length
};

/// The faces around a node, joined across smooth edges. Only edges that neighbours traverse in
/// opposite directions are smooth: others belong to faces that look to different sides.
class Fan {
 public:
  std::vector<FanCorner> corners;

  /// Joins faces whose normals have at least this cosine. Returns whether all are one part.
  bool join(double cosine) {
    parts_.resize(corners.size());
    std::iota(parts_.begin(), parts_.end(), 0u);
    left_ = corners.size();
    sharp_ = 0;
    open_ = doubled_ = false;
    edges_.clear();
    for (std::uint32_t i = 0; i < corners.size(); ++i) {
      edges_.push_back({corners[i].before, 0, i});
      edges_.push_back({corners[i].after, 1, i});
    }
    std::sort(edges_.begin(), edges_.end());
    for (std::size_t begin = 0, end = 0; begin < edges_.size(); begin = end) {
      while (end < edges_.size() && edges_[end][0] == edges_[begin][0]) ++end;
      join_edge(begin, end, cosine);
    }
    return left_ <= 1;
  }
  /// The first corner of the part that a corner is in.
  std::uint32_t part(std::uint32_t i) {
    while (parts_[i] != i) i = parts_[i] = parts_[parts_[i]];
    return i;
  }
  /// Sharp edges of a fan that is closed: all its edges have two faces. Of others 0.
  [[nodiscard]] std::uint32_t sharp() const { return open_ ? 0 : sharp_; }
  /// Whether a triangle occurs in both windings.
  [[nodiscard]] bool doubled() const { return doubled_; }

 private:
  /// Edges [begin, end) have the same ends: first those by which faces reach the node.
  void join_edge(std::size_t begin, std::size_t end, double cosine) {
    std::size_t middle = begin;
    while (middle < end && edges_[middle][1] == 0) ++middle;
    open_ = open_ || middle != begin + 1 || end != begin + 2;
    if ((middle - begin) * (end - middle) > kMostPairs) return;
    for (std::size_t i = begin; i < middle; ++i) {
      for (std::size_t k = middle; k < end; ++k) {
        const FanCorner& a = corners[edges_[i][2]];
        const FanCorner& b = corners[edges_[k][2]];
        if (a.before == b.after && a.after == b.before) {
          doubled_ = true;
        } else if (glm::dot(a.normal, b.normal) >= cosine) {
          const std::uint32_t one = part(edges_[i][2]);
          const std::uint32_t other = part(edges_[k][2]);
          if (one != other) --left_;
          parts_[std::max(one, other)] = std::min(one, other);
        } else {
          ++sharp_;
        }
      }
    }
  }

  std::vector<std::uint32_t> parts_;
  std::vector<std::array<std::uint32_t, 3>> edges_;  // other end, whether leaving, corner
  std::size_t left_ = 0;
  std::uint32_t sharp_ = 0;
  bool open_ = false;
  bool doubled_ = false;
};

/// Makes the normals of one model. A node is what corners with one normal share: a position in a
/// smoothing group, or a face in group 0.
class NormalMaker {
 public:
  NormalMaker(SourceModel& source, double crease)
      : source_(source), crease_(crease), identity_(has_identity_indices(source)) {}

  MadeNormals run() {
    if (!find_missing()) return std::move(result_);
    make_sums();
    first_.release();
    next_.release();
    Array<glm::vec3> normals = to_normals(std::move(sums_));
    mark(normals);
    if (marked_ != 0) {
      gather();
      split(crease_);
      result_.noise = is_noise();
      if (result_.noise) {
        added_.resize(0);
        moved_.resize(0);
        if (doubled_) split(180);
      }
    }
    store(std::move(normals));
    return std::move(result_);
  }

 private:
  /// Whether a corner lacks a normal. Then nodes take their places among the corners' normals.
  bool find_missing() {
    if (source_.corner_normals.kind == IndexPlane::Kind::kAbsent && identity_) return true;
    identity_ = false;
    base_ = static_cast<std::uint32_t>(source_.normals.size());
    const auto good = [&](std::size_t c) {
      const std::uint32_t n = source_.corner_normals.at(c, source_.corner_positions[c]);
      if (n != kNoIndex && !has_direction(source_.normals[n])) ++result_.bad;
      return n != kNoIndex && has_direction(source_.normals[n]);
    };
    std::size_t c = 0;
    while (c < source_.corner_count() && good(c)) ++c;
    if (c == source_.corner_count()) return false;
    Array<std::uint32_t> own(source_.corner_count());
    for (std::size_t k = 0; k < own.size(); ++k) {
      own[k] = source_.corner_normals.at(k, source_.corner_positions[k]);
    }
    result_.bad = 0;
    for (std::size_t k = 0; k < own.size(); ++k) {
      if (!good(k)) own[k] = kNoIndex;
    }
    source_.corner_normals.kind = IndexPlane::Kind::kOwn;
    source_.corner_normals.own = std::move(own);
    return true;
  }

  [[nodiscard]] const glm::dvec3& place(std::size_t corner) const {
    return source_.positions[source_.corner_positions[corner]];
  }
  /// Twice the area, along the normal; 0 where a coordinate is not finite.
  [[nodiscard]] glm::dvec3 area_of(std::size_t first, std::size_t count) const {
    glm::dvec3 area(0.0);
    for (std::size_t i = 2; i < count; ++i) {
      area += glm::cross(place(first + i - 1) - place(first), place(first + i) - place(first));
    }
    return std::isfinite(area.x + area.y + area.z) ? area : glm::dvec3(0.0);
  }
  /// The node of a corner; kNoIndex where the file gives it a normal. After make_sums().
  [[nodiscard]] std::uint32_t node_of(std::size_t corner) const {
    if (identity_) return source_.corner_positions[corner];
    const std::uint32_t n = source_.corner_normals.own[corner];
    return n >= base_ ? n - base_ : kNoIndex;
  }

  void make_sums() {
    if (identity_) sums_.assign(source_.positions.size(), glm::dvec3(0.0));
    CornerShares shares(sums_);
    RunCursor smoothing(source_.smoothing_runs);
    for (std::size_t f = 0; f < source_.face_count(); ++f) {
      const std::size_t first = source_.face_first(f);
      const std::size_t count = source_.face_size(f);
      const glm::dvec3 area = area_of(first, count);
      const double length = glm::length(area);
      const std::uint32_t group = smoothing.at(f);
      std::uint32_t flat = kNoIndex;
      for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t node = source_.corner_positions[first + i];
        if (!identity_) {
          std::uint32_t& own = source_.corner_normals.own[first + i];
          if (own != kNoIndex) continue;
          if (group == 0 && flat == kNoIndex) flat = add_node(group);
          node = group == 0 ? flat : node_in(node, group);
          own = base_ + node;
        }
        const glm::dvec3& here = place(first + i);
        const glm::dvec3 after = place(first + (i + 1 < count ? i + 1 : 0)) - here;
        const glm::dvec3 before = place(first + (i > 0 ? i : count) - 1) - here;
        shares.add(node, area, count == 3 ? length : glm::length(glm::cross(after, before)),
                   glm::dot(after, before));
      }
    }
  }
  std::uint32_t add_node(std::uint32_t group) {
    sums_.push_back(glm::dvec3(0.0));
    next_.push_back(kNoIndex);
    group_.push_back(group);
    return static_cast<std::uint32_t>(sums_.size() - 1);
  }
  std::uint32_t node_in(std::uint32_t position, std::uint32_t group) {
    if (first_.empty()) first_.assign(source_.positions.size(), kNoIndex);
    for (std::uint32_t n = first_[position]; n != kNoIndex; n = next_[n]) {
      if (group_[n] == group) return n;
    }
    const std::uint32_t n = add_node(group);
    next_[n] = first_[position];
    return first_[position] = n;
  }
  [[nodiscard]] std::uint32_t group_at(std::uint32_t node) const {
    return identity_ ? source_.smoothing_runs[0].value : group_[node];
  }

  /// Marks the nodes that a fan may have to be split at: where all faces are within half the angle
  /// of their normal, no two differ by more than the angle.
  void mark(const Array<glm::vec3>& normals) {
    slots_.assign(normals.size(), kNoIndex);
    const double half = std::cos(crease_ / 2 * kDegree) + kRounding;
    for (std::size_t f = 0; f < source_.face_count(); ++f) {
      const std::size_t first = source_.face_first(f);
      const std::size_t count = source_.face_size(f);
      const glm::dvec3 area = area_of(first, count);
      const double least = half * glm::length(area);
      for (std::size_t c = first; c < first + count; ++c) {
        const std::uint32_t node = node_of(c);
        if (node == kNoIndex || glm::dot(area, glm::dvec3(normals[node])) >= least) continue;
        const std::uint32_t group = group_at(node);
        if (slots_[node] == kNoIndex && group != 0) slots_[node] = marked_++;
      }
    }
  }

  /// Lists the corners with an area of marked nodes, node by node.
  void gather() {
    starts_.assign(marked_ + 1, 0);
    const auto each = [&](const auto& body) {
      for (std::uint32_t f = 0; f < source_.face_count(); ++f) {
        const std::size_t first = source_.face_first(f);
        for (std::size_t c = first; c < first + source_.face_size(f); ++c) {
          const std::uint32_t node = node_of(c);
          if (node != kNoIndex && slots_[node] != kNoIndex) {
            body(slots_[node], static_cast<std::uint32_t>(c), f);
          }
        }
      }
    };
    each([&](std::uint32_t slot, std::uint32_t, std::uint32_t) { ++starts_[slot + 1]; });
    for (std::size_t s = 1; s <= marked_; ++s) starts_[s] += starts_[s - 1];
    Array<std::uint32_t> next = starts_;
    listed_.resize(starts_[marked_]);
    each([&](std::uint32_t slot, std::uint32_t corner, std::uint32_t face) {
      listed_[next[slot]++] = {corner, face};
    });
  }

  [[nodiscard]] FanCorner fan_corner(std::uint32_t c, std::uint32_t f) const {
    const std::size_t first = source_.face_first(f);
    const std::size_t count = source_.face_size(f);
    const std::size_t after = c + 1 < first + count ? c + 1 : first;
    const std::size_t before = (c > first ? c : first + count) - 1;
    FanCorner corner{c, f, source_.corner_positions[before], source_.corner_positions[after]};
    const glm::dvec3 area = area_of(first, count);
    const glm::dvec3 to_after = place(after) - place(c);
    const glm::dvec3 to_before = place(before) - place(c);
    const double sine = glm::length(glm::cross(to_after, to_before));
    const double cosine = glm::dot(to_after, to_before);
    corner.share = area * angles_of(Pair{sine, sine}, Pair{cosine, cosine})[0];
    const double length = glm::length(area);
    if (length > 0) corner.normal = area / length;
    return corner;
  }

  /// Gives each further part of a fan a node of its own. Groups that the file states are split only
  /// where triangles occur in both windings.
  void split(double crease) {
    Fan fan;
    const double cosine = std::cos(crease * kDegree) - kRounding;
    for (std::uint32_t s = 0; s < marked_; ++s) {
      fan.corners.clear();
      for (std::uint32_t i = starts_[s]; i < starts_[s + 1]; ++i) {
        fan.corners.push_back(fan_corner(listed_[i][0], listed_[i][1]));
        if (fan.corners.back().normal == glm::dvec3(0.0)) fan.corners.pop_back();
      }
      if (fan.corners.empty()) continue;
      const bool stated = group_at(node_of(fan.corners[0].corner)) != kUnstatedSmoothing;
      const bool smooth = stated || crease >= 180;
      const bool whole = fan.join(smooth ? -2.0 : cosine);
      doubled_ = doubled_ || fan.doubled();
      if (fan.sharp() != 0) ++creased_;
      if (fan.sharp() == 1) ++loose_;
      if (!whole && (!smooth || fan.doubled())) add_parts(fan);
    }
  }
  void add_parts(Fan& fan) {
    std::vector<std::uint32_t>& numbers = numbers_;
    numbers.assign(fan.corners.size(), kNoIndex);
    for (std::uint32_t i = 0; i < fan.corners.size(); ++i) {
      const std::uint32_t part = fan.part(i);
      if (part == i) {
        numbers[i] = static_cast<std::uint32_t>(added_.size());
        added_.push_back(glm::dvec3(0.0));
      }
      const std::uint32_t number = numbers[part];
      added_[number] += fan.corners[i].share;
      moved_.push_back({fan.corners[i].corner, number});
    }
  }
  [[nodiscard]] bool is_noise() const {
    const bool rough = creased_ >= kManyCreased && 2 * creased_ > source_.positions.size();
    return creased_ >= kFewCreased &&
           static_cast<double>(loose_) >
               (rough ? kRoughNoise : kNoise) * static_cast<double>(creased_);
  }

  /// The first part of a fan takes the node's place, the others get new ones.
  void store(Array<glm::vec3>&& normals) {
    std::vector<std::uint32_t> nodes(added_.size(), kNoIndex);
    for (const auto& [corner, number] : moved_) {
      const std::uint32_t node = node_of(corner);
      std::uint32_t& own = nodes[number];
      if (own == kNoIndex && slots_[node] != kNoIndex) {
        own = node;
        slots_[node] = kNoIndex;
        normals[node] = normal_of(added_[number]);
      } else if (own == kNoIndex) {
        own = static_cast<std::uint32_t>(normals.size());
        normals.push_back(normal_of(added_[number]));
        if (identity_) copy_position(node);
      }
      if (own == node) continue;
      (identity_ ? source_.corner_positions : source_.corner_normals.own)[corner] = base_ + own;
    }
    result_.made = normals.size();
    if (identity_) {
      source_.corner_normals.kind = IndexPlane::Kind::kSame;
      source_.normals = std::move(normals);
    } else {
      source_.normals.append(normals.data(), normals.size());
    }
  }
  void copy_position(std::uint32_t p) {
    const bool own_uvs = source_.corner_uvs.kind == IndexPlane::Kind::kSame;
    if (own_uvs) source_.uvs.resize(source_.positions.size());
    result_.from.push_back(p);
    source_.positions.push_back(source_.positions[p]);
    if (own_uvs) source_.uvs.push_back(source_.uvs[p]);
    if (!source_.colours.empty()) source_.colours.push_back(source_.colours[p]);
    if (!source_.vertex_bones.empty()) source_.vertex_bones.push_back(source_.vertex_bones[p]);
  }

  SourceModel& source_;
  double crease_;
  bool identity_;           // the node of a corner is its position
  std::uint32_t base_ = 0;  // normals that the file has
  MadeNormals result_;
  Array<glm::dvec3> sums_;
  Array<std::uint32_t> first_;  // node of each position
  Array<std::uint32_t> next_;   // of the same position, of each node
  Array<std::uint32_t> group_;  // of each node
  Array<std::uint32_t> slots_;  // of each node that is marked
  std::uint32_t marked_ = 0;
  Array<std::uint32_t> starts_;                 // of each slot in listed_
  Array<std::array<std::uint32_t, 2>> listed_;  // corners and faces
  std::vector<std::uint32_t> numbers_;
  Array<glm::dvec3> added_;                    // sums of the parts of fans that are split
  Array<std::array<std::uint32_t, 2>> moved_;  // corners and the part of each
  std::uint64_t creased_ = 0;                  // positions with sharp edges
  std::uint64_t loose_ = 0;                    // of them, where one sharp edge ends
  bool doubled_ = false;
};

}  // namespace

bool has_direction(const glm::vec3& normal) {
  const float square = glm::dot(normal, normal);
  return square > 1e-30f && square < 1e30f;
}

bool has_identity_indices(const SourceModel& source) {
  using Kind = IndexPlane::Kind;
  if (!source.first_corner.empty() || source.corner_uvs.kind == Kind::kOwn) return false;
  if (source.corner_uvs.kind == Kind::kSame && source.uvs.size() < source.positions.size()) {
    return false;
  }
  if (source.corner_normals.kind == Kind::kSame) {
    return source.normals.size() >= source.positions.size() &&
           std::all_of(source.normals.begin(), source.normals.end(), has_direction);
  }
  return source.corner_normals.kind == Kind::kAbsent && source.smoothing_runs.size() == 1 &&
         source.smoothing_runs[0].value != 0;
}

MadeNormals make_normals(SourceModel& source, double crease) {
  return NormalMaker(source, crease).run();
}

}  // namespace modar
