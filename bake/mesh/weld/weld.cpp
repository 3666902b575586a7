// Polygons to welded triangles in [-1,1]: picks one of two ways, normalises, reports what was
// dropped or made.
#include "bake/mesh/weld/weld.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "bake/import/source_model.hpp"
#include "bake/mesh/weld/triangulate.hpp"
#include "formats/base/parallel.hpp"

namespace modar {
namespace {

struct WeldCounts {
  std::uint64_t flat = 0;         ///< triangles without area
  std::uint64_t not_finite = 0;   ///< triangles with a nan
  std::uint64_t tangled = 0;      ///< polygons
  std::uint64_t bad_normals = 0;  ///< corners whose normal has no direction
  std::uint64_t made_normals = 0;
};

/// Twice the area vector of a triangle, in doubles.
glm::dvec3 area_vector(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return glm::cross(b - a, c - a);
}

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Does a source normal have a direction?
bool has_direction(const glm::vec3& n) {
  const float square = glm::dot(n, n);
  return square > 1e-30f && square < 1e30f;
}

/// Flips v; non-finite coordinates become the image's corner.
glm::dvec2 image_uv(const glm::dvec2& uv) {
  if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return glm::dvec2(0.0, 1.0);
  return {uv.x, 1.0 - uv.y};
}

/// colour: in [0,1].
glm::u8vec4 byte_colour(const glm::vec3& colour) {
  const glm::vec3 c = colour * 255.0f + 0.5f;
  return {static_cast<std::uint8_t>(c.x), static_cast<std::uint8_t>(c.y),
          static_cast<std::uint8_t>(c.z), std::uint8_t{255}};
}

/// What a triangle adds to the normals of its corners: its area vector times the angle there, so
/// that neither thin nor many triangles of one flat side tilt the normal (Max, "Weights for
/// computing vertex normals from facet normals", 1999, for the area; Thuermer and Wuethrich, 1998,
/// for the angle). Many triangles at a time, two angles in one instruction.
class TriangleShares {
 public:
  /// Triangles at a time: what they need fills half of a first-level cache. Of 16 to 256, which
  /// differ by less than their noise.
  static constexpr std::size_t kMost = 128;

  /// Sets triangle i of a batch. area: area_vector() of its corners.
  void set(std::size_t i, const glm::dvec3& area, const glm::dvec3& p0, const glm::dvec3& p1,
           const glm::dvec3& p2) {
    const glm::dvec3 e01 = p1 - p0;
    const glm::dvec3 e02 = p2 - p0;
    const glm::dvec3 e12 = p2 - p1;
    area_[i] = area;
    sine_[i] = glm::length(area);
    cosine_[0][i] = glm::dot(e01, e02);
    cosine_[1][i] = -glm::dot(e12, e01);
    cosine_[2][i] = glm::dot(e02, e12);
  }
  /// Computes the shares of the first `count` triangles.
  void compute(std::size_t count);
  /// After compute().
  [[nodiscard]] glm::dvec3 at(std::size_t i, std::size_t corner) const {
    return area_[i] * angle_[corner][i];
  }

 private:
  using Values = std::array<double, kMost>;
  std::array<glm::dvec3, kMost> area_;
  Values sine_{};                   // times the lengths of the two sides, as the cosines are
  std::array<Values, 3> cosine_{};  // of each corner
  std::array<Values, 3> angle_;
};

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

void TriangleShares::compute(std::size_t count) {
  for (std::size_t corner = 0; corner < 3; ++corner) {
    for (std::size_t i = 0; i < count; i += 2) {
      Pair sine;
      Pair cosine;
      std::memcpy(&sine, &sine_[i], sizeof sine);
      std::memcpy(&cosine, &cosine_[corner][i], sizeof cosine);
      const Pair angle = angles_of(sine, cosine);
      std::memcpy(&angle_[corner][i], &angle, sizeof angle);
    }
  }
}

/// Unit normals of sums of shares; (0, 0, 1) where the shares cancel. In the memory of the sums.
Array<glm::vec3> to_normals(Array<glm::dvec3>&& sums) {
  const std::size_t count = sums.size();
  auto* const bytes = reinterpret_cast<unsigned char*>(sums.data());
  for (std::size_t v = 0; v < count; ++v) {
    const glm::dvec3 sum = sums[v];
    const double length = glm::length(sum);
    const glm::vec3 normal(length > 0 && std::isfinite(length) ? sum / length
                                                               : glm::dvec3(0, 0, 1));
    // Ends where the next sum begins, or before.
    std::memcpy(bytes + v * sizeof normal, &normal, sizeof normal);
  }
  Array<glm::vec3> normals = Array<glm::vec3>::split(std::move(sums));
  normals.resize(count);
  normals.shrink();
  return normals;
}

/// Collects the faces around each (position, smoothing group); group 0 makes flat faces.
class NormalMaker {
 public:
  /// Number of the normal shared by the corners of this position and group; made on first use.
  std::uint32_t node(std::uint32_t position, std::uint32_t group, std::size_t position_count);
  /// Number of a normal that belongs to one face.
  std::uint32_t flat_node();
  /// Adds a triangle's share to one corner.
  void add(std::uint32_t node, const glm::dvec3& share) { sums_[node] += share; }
  /// Normals by number.
  [[nodiscard]] Array<glm::vec3> take_normals() { return to_normals(std::move(sums_)); }

 private:
  Array<std::uint32_t> first_;  // of each position, kNoIndex where none
  Array<std::uint32_t> next_;   // of each node
  Array<std::uint32_t> group_;
  Array<glm::dvec3> sums_;
};

std::uint32_t NormalMaker::node(std::uint32_t position, std::uint32_t group,
                                std::size_t position_count) {
  if (first_.empty()) first_.assign(position_count, kNoIndex);
  for (std::uint32_t n = first_[position]; n != kNoIndex; n = next_[n]) {
    if (group_[n] == group) return n;
  }
  const std::uint32_t n = flat_node();
  next_[n] = first_[position];
  group_[n] = group;
  first_[position] = n;
  return n;
}

std::uint32_t NormalMaker::flat_node() {
  sums_.push_back(glm::dvec3(0.0));
  next_.push_back(kNoIndex);
  group_.push_back(0);
  return static_cast<std::uint32_t>(sums_.size() - 1);
}

/// Numbers distinct (position, uv, normal) triples by first use, in a list per position: corners
/// that share a position are near each other in files, so a hash is needed only for hubs with very
/// many vertices.
class VertexWeld {
 public:
  explicit VertexWeld(std::size_t position_count) : first_(position_count, kNoIndex) {}

  std::uint32_t vertex(const Corner& key) {
    std::uint32_t steps = 0;
    for (std::uint32_t v = first_[key.position]; v != kNoIndex; v = next_[v]) {
      if (keys_[v].uv == key.uv && keys_[v].normal == key.normal) return v;
      if (++steps == kMaxSteps) return from_hub(key);
    }
    return add(key);
  }

  /// The triple of each vertex.
  [[nodiscard]] const Array<Corner>& keys() const { return keys_; }
  /// Frees everything but the keys.
  void finish() {
    first_.release();
    next_.release();
    hubs_.clear();
  }

 private:
  /// Longer lists are hashed, which keeps adversarial files linear; real ones need under 10 steps.
  static constexpr std::uint32_t kMaxSteps = 64;

  std::uint32_t add(const Corner& key);
  std::uint32_t from_hub(const Corner& key);

  Array<std::uint32_t> first_;  // of each position
  Array<std::uint32_t> next_;   // of each vertex
  Array<Corner> keys_;          // of each vertex
  std::unordered_map<std::uint32_t, std::unordered_map<std::uint64_t, std::uint32_t>> hubs_;
};

std::uint64_t attributes_of(const Corner& c) {
  return (std::uint64_t{c.uv} << 32) | c.normal;
}

std::uint32_t VertexWeld::add(const Corner& key) {
  const auto v = static_cast<std::uint32_t>(keys_.size());
  keys_.push_back(key);
  next_.push_back(first_[key.position]);
  first_[key.position] = v;
  return v;
}

std::uint32_t VertexWeld::from_hub(const Corner& key) {
  // Only looked up, so the hash's order shows nowhere.
  auto& hub = hubs_[key.position];
  if (hub.empty()) {
    for (std::uint32_t v = first_[key.position]; v != kNoIndex; v = next_[v]) {
      hub.emplace(attributes_of(keys_[v]), v);
    }
  }
  const auto [at, fresh] = hub.try_emplace(attributes_of(key), 0);
  if (fresh) at->second = add(key);
  return at->second;
}

// The general way: polygons, seams, missing and made normals.

/// Flags a made normal's number in a vertex key; numbers of source normals are below it.
constexpr std::uint32_t kMade = 0x80000000u;

/// Runs over the faces once: triangulates, drops, gathers normals, welds.
class Welder {
 public:
  Welder(SourceModel& source, TriMesh& mesh, WeldCounts& counts)
      : source_(source), mesh_(mesh), counts_(counts), weld_(source.positions.size()) {}

  void run() {
    const std::size_t faces = source_.face_count();
    // One triangle a face, two less than corners in all: exact but for what is dropped.
    const std::size_t triangles = source_.corner_count() - 2 * faces;
    mesh_.triangles.reserve(triangles);
    mesh_.triangle_material.reserve(triangles);
    RunCursor materials(source_.material_runs);
    RunCursor smoothing(source_.smoothing_runs);
    for (std::size_t f = 0; f < faces; ++f) {
      material_ = materials.at(f);
      smoothing_ = smoothing.at(f);
      face(f);
    }
  }

  /// Fills the mesh's vertex arrays, freeing the source's as it goes.
  void finish() {
    weld_.finish();
    source_.corner_positions.release();
    source_.corner_uvs.own.release();
    source_.corner_normals.own.release();
    source_.first_corner.release();
    const Array<Corner>& keys = weld_.keys();
    const std::size_t count = keys.size();
    mesh_.normals.resize(count);
    fill_normals(keys);
    source_.normals.release();
    fill_uvs(keys);
    source_.uvs.release();
    mesh_.source_positions.resize(count);
    for (std::size_t v = 0; v < count; ++v) mesh_.source_positions[v] = keys[v].position;
    if (!source_.colours.empty()) {
      mesh_.colours.resize(count);
      for (std::size_t v = 0; v < count; ++v) {
        mesh_.colours[v] = byte_colour(source_.colours[keys[v].position]);
      }
    }
    mesh_.positions.resize(count);
    for (std::size_t v = 0; v < count; ++v) {
      mesh_.positions[v] = source_.positions[keys[v].position];
    }
    source_.positions.release();
    source_.colours.release();
  }

 private:
  void fill_normals(const Array<Corner>& keys) {
    const Array<glm::vec3> made = normals_.take_normals();
    counts_.made_normals = made.size();
    for (std::size_t v = 0; v < keys.size(); ++v) {
      const std::uint32_t n = keys[v].normal;
      mesh_.normals[v] = (n & kMade) != 0 ? made[n & ~kMade] : glm::normalize(source_.normals[n]);
    }
  }

  void fill_uvs(const Array<Corner>& keys) {
    const bool any =
        std::any_of(keys.begin(), keys.end(), [](const Corner& key) { return key.uv != kNoIndex; });
    if (!any) return;
    mesh_.uvs.resize(keys.size());
    for (std::size_t v = 0; v < keys.size(); ++v) {
      const std::uint32_t uv = keys[v].uv;
      mesh_.uvs[v] = image_uv(uv == kNoIndex ? glm::dvec2(0.0) : source_.uvs[uv]);
    }
  }

  void face(std::size_t f) {
    const std::size_t first = source_.face_first(f);
    const std::size_t count = source_.face_size(f);
    flat_ = kNoIndex;
    if (count == 3) {
      triangle(first, {0, 1, 2});
      return;
    }
    polygon_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      polygon_.push_back(source_.positions[source_.corner_positions[first + i]]);
    }
    triangles_.clear();
    if (!triangulate(polygon_, triangles_)) ++counts_.tangled;
    for (const auto& t : triangles_) triangle(first, t);
  }

  void triangle(std::size_t first, const std::array<std::uint32_t, 3>& t) {
    std::array<Corner, 3> corners;
    std::array<glm::dvec3, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      corners[i] = source_.corner(first + t[i]);
      p[i] = source_.positions[corners[i].position];
    }
    const glm::dvec3 area = area_vector(p[0], p[1], p[2]);
    if (!is_finite(area)) {
      ++counts_.not_finite;
      return;
    }
    if (area == glm::dvec3(0.0)) {
      ++counts_.flat;
      return;
    }
    std::array<std::uint32_t, 3> out{};
    bool computed = false;
    for (std::size_t i = 0; i < 3; ++i) {
      Corner& key = corners[i];
      if (!has_normal(key)) {
        if (!computed) {
          shares_.set(0, area, p[0], p[1], p[2]);
          shares_.compute(1);
          computed = true;
        }
        const std::uint32_t node = normal_node(key.position);
        normals_.add(node, shares_.at(0, i));
        key.normal = kMade | node;
      }
      out[i] = weld_.vertex(key);
    }
    mesh_.triangles.push_back(out);
    mesh_.triangle_material.push_back(material_);
  }

  bool has_normal(const Corner& corner) {
    if (corner.normal == kNoIndex) return false;
    if (has_direction(source_.normals[corner.normal])) return true;
    ++counts_.bad_normals;
    return false;
  }

  std::uint32_t normal_node(std::uint32_t position) {
    if (smoothing_ != 0) return normals_.node(position, smoothing_, source_.positions.size());
    if (flat_ == kNoIndex) flat_ = normals_.flat_node();
    return flat_;
  }

  SourceModel& source_;
  TriMesh& mesh_;
  WeldCounts& counts_;
  VertexWeld weld_;
  NormalMaker normals_;
  TriangleShares shares_;
  std::uint32_t material_ = 0;
  std::uint32_t smoothing_ = 0;
  std::uint32_t flat_ = kNoIndex;  // the normal of the face at hand, where it is flat
  std::vector<glm::dvec3> polygon_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

void weld_any(SourceModel& source, TriMesh& mesh, WeldCounts& counts) {
  Welder welder(source, mesh, counts);
  welder.run();
  if (!mesh.triangles.empty()) welder.finish();
}

// The way of files whose corners repeat one index (most scans): works in the source's arrays.

/// Elements that a thread takes at a time: a million make 16 parts.
constexpr std::size_t kElementsPerTask = 1u << 16;

std::uint32_t stretches(std::size_t count) {
  return static_cast<std::uint32_t>((count + kElementsPerTask - 1) / kElementsPerTask);
}

/// Calls body(begin, end) over [0, count) in stretches, on several threads.
template <class Body>
void parallel_stretches(std::size_t count, unsigned jobs, const Body& body) {
  parallel_rows(stretches(count), jobs, [&](std::uint32_t s) {
    const std::size_t begin = s * kElementsPerTask;
    body(begin, std::min(begin + kElementsPerTask, count));
  });
}

enum class TriangleClass : std::uint8_t { kKeep, kZeroArea, kNotFinite };

/// Classifies each triangle; marks the positions of those that are kept.
Array<TriangleClass> classify(const SourceModel& source, Array<std::uint8_t>& used, unsigned jobs) {
  const std::size_t count = source.face_count();
  Array<TriangleClass> classes(count);
  used.assign(source.positions.size(), 0);
  parallel_stretches(count, jobs, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const std::uint32_t* v = source.corner_positions.data() + 3 * t;
      const glm::dvec3 area =
          area_vector(source.positions[v[0]], source.positions[v[1]], source.positions[v[2]]);
      classes[t] = !is_finite(area)          ? TriangleClass::kNotFinite
                   : area == glm::dvec3(0.0) ? TriangleClass::kZeroArea
                                             : TriangleClass::kKeep;
      if (classes[t] != TriangleClass::kKeep) continue;
      // Several threads may mark one position, all with the same value.
      for (int i = 0; i < 3; ++i) {
        std::atomic_ref<std::uint8_t>(used[v[i]]).store(1, std::memory_order_relaxed);
      }
    }
  });
  return classes;
}

/// Removes dropped triangles and lists the materials of the rest.
void keep_triangles(SourceModel& source, const Array<TriangleClass>& classes, TriMesh& mesh,
                    WeldCounts& counts) {
  RunCursor materials(source.material_runs);
  mesh.triangle_material.resize(classes.size());
  std::uint32_t* corners = source.corner_positions.data();
  std::size_t kept = 0;
  for (std::size_t t = 0; t < classes.size(); ++t) {
    const std::uint32_t material = materials.at(t);
    if (classes[t] != TriangleClass::kKeep) {
      ++(classes[t] == TriangleClass::kZeroArea ? counts.flat : counts.not_finite);
      continue;
    }
    mesh.triangle_material[kept] = material;
    if (kept != t) std::copy_n(corners + 3 * t, 3, corners + 3 * kept);
    ++kept;
  }
  mesh.triangle_material.resize(kept);
  source.corner_positions.resize(3 * kept);
}

template <class T>
void keep_elements(Array<T>& values, const Array<std::uint8_t>& used) {
  if (values.empty()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] != 0) values[kept++] = values[i];
  }
  values.resize(kept);
  values.shrink();
}

/// Removes positions that no triangle uses; `to` holds the new numbers of the others.
void drop_unused(SourceModel& source, const Array<std::uint8_t>& used, TriMesh& mesh) {
  if (std::find(used.begin(), used.end(), std::uint8_t{0}) == used.end()) return;
  Array<std::uint32_t> to(used.size());
  for (std::size_t i = 0; i < used.size(); ++i) {
    to[i] = static_cast<std::uint32_t>(mesh.source_positions.size());
    if (used[i] != 0) mesh.source_positions.push_back(static_cast<std::uint32_t>(i));
  }
  for (std::uint32_t& v : source.corner_positions) v = to[v];
  keep_elements(source.positions, used);
  keep_elements(source.normals, used);
  keep_elements(source.uvs, used);
  keep_elements(source.colours, used);
}

/// A normal for each position, for sources without normals.
void make_normals(const SourceModel& source, TriMesh& mesh, WeldCounts& counts) {
  Array<glm::dvec3> sums(source.positions.size(), glm::dvec3(0.0));
  TriangleShares shares;
  for (std::size_t first = 0; first < mesh.triangles.size(); first += TriangleShares::kMost) {
    const std::size_t count = std::min(TriangleShares::kMost, mesh.triangles.size() - first);
    const std::array<std::uint32_t, 3>* const triangles = mesh.triangles.data() + first;
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [a, b, c] = triangles[i];
      const glm::dvec3& p0 = source.positions[a];
      const glm::dvec3& p1 = source.positions[b];
      const glm::dvec3& p2 = source.positions[c];
      shares.set(i, area_vector(p0, p1, p2), p0, p1, p2);
    }
    shares.compute(count);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t corner = 0; corner < 3; ++corner) {
        sums[triangles[i][corner]] += shares.at(i, corner);
      }
    }
  }
  mesh.normals = to_normals(std::move(sums));
  counts.made_normals = mesh.normals.size();
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

void weld_identity_indices(SourceModel& source, TriMesh& mesh, WeldCounts& counts, unsigned jobs) {
  if (source.corner_uvs.kind == IndexPlane::Kind::kAbsent) source.uvs.release();
  if (source.corner_normals.kind == IndexPlane::Kind::kAbsent) source.normals.release();
  // No corner refers to elements beyond the last position.
  if (!source.uvs.empty()) source.uvs.resize(source.positions.size());
  if (!source.normals.empty()) source.normals.resize(source.positions.size());
  Array<std::uint8_t> used;
  keep_triangles(source, classify(source, used, jobs), mesh, counts);
  if (mesh.triangle_material.empty()) return;
  drop_unused(source, used, mesh);
  used.release();
  mesh.triangles = Array<std::array<std::uint32_t, 3>>::regroup(std::move(source.corner_positions));
  if (source.normals.empty()) {
    make_normals(source, mesh, counts);
  } else {
    mesh.normals = std::move(source.normals);
    parallel_stretches(mesh.normals.size(), jobs, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) mesh.normals[v] = glm::normalize(mesh.normals[v]);
    });
  }
  mesh.uvs = std::move(source.uvs);
  for (glm::dvec2& uv : mesh.uvs) uv = image_uv(uv);
  mesh.colours.resize(source.colours.size());
  for (std::size_t v = 0; v < mesh.colours.size(); ++v) {
    mesh.colours[v] = byte_colour(source.colours[v]);
  }
  source.colours.release();
  mesh.positions = std::move(source.positions);
}

// Picking the way, and what both share.

/// Brings the positions into [-1,1]; the model's largest side fills it.
void normalise(TriMesh& mesh) {
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high(-low);
  for (const glm::dvec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  mesh.source_min = low;
  mesh.source_max = high;
  // Halves first: the sum of two huge coordinates may overflow.
  mesh.placement.center = low * 0.5 + high * 0.5;
  const glm::dvec3 half = high * 0.5 - low * 0.5;
  mesh.placement.scale = std::max({half.x, half.y, half.z});
  for (glm::dvec3& p : mesh.positions) {
    p = glm::clamp((p - mesh.placement.center) / mesh.placement.scale, -1.0, 1.0);
  }
}

/// Keeps only the materials that triangles use, in the same order.
void keep_used_materials(const SourceModel& source, TriMesh& mesh) {
  std::vector<std::uint32_t> to(source.materials.size(), kNoIndex);
  for (const std::uint32_t m : mesh.triangle_material) to[m] = 0;
  for (std::size_t m = 0; m < to.size(); ++m) {
    if (to[m] == kNoIndex) continue;
    to[m] = static_cast<std::uint32_t>(mesh.materials.size());
    mesh.materials.push_back(source.materials[m]);
  }
  for (std::uint32_t& m : mesh.triangle_material) m = to[m];
}

/// Share of a model's triangles whose loss is worth a warning.
constexpr double kMuchLoss = 0.01;

/// triangles: that are left.
void report_counts(const std::string& name, const WeldCounts& counts, std::size_t triangles,
                   Report& report) {
  const auto add = [&](std::uint64_t count, const char* id, DiagnosticSeverity severity,
                       const char* message, const char* cure) {
    if (count == 0) return;
    report.diagnostics.push_back(
        {id, severity, name, 0, std::to_string(count) + " " + message, cure});
  };
  const double all = static_cast<double>(counts.flat + counts.not_finite + triangles);
  const bool much = static_cast<double>(counts.flat) > kMuchLoss * all;
  add(counts.flat, "model.degenerate",
      much ? DiagnosticSeverity::kWarning : DiagnosticSeverity::kInfo,
      "triangles without area left out (corners on one line, or one corner twice)",
      much ? "check the export of the model" : "");
  add(counts.not_finite, "model.not-finite", DiagnosticSeverity::kWarning,
      "triangles with non-finite vertices left out", "export the model again");
  add(counts.tangled, "model.tangled-polygon", DiagnosticSeverity::kWarning,
      "polygons intersect themselves or are too large to triangulate well",
      "triangulate the model before export");
  add(counts.bad_normals, "model.bad-normal", DiagnosticSeverity::kInfo,
      "corners have a normal of length 0", "normals were computed for them");
  add(counts.made_normals, "model.made-normals", DiagnosticSeverity::kInfo,
      "normals were computed from the faces", "");
}

}  // namespace

Result<TriMesh> weld(SourceModel&& source, Report& report, const WeldOptions& options) {
  StageTimer timer(report, "weld");
  TriMesh mesh;
  mesh.name = source.name;
  mesh.up = source.up;
  mesh.source_vertex_count = source.positions.size();
  mesh.source_face_count = source.face_count();
  WeldCounts counts;
  if (has_identity_indices(source)) {
    weld_identity_indices(source, mesh, counts, options.jobs);
  } else {
    weld_any(source, mesh, counts);
  }
  if (mesh.triangles.empty()) {
    return fail(ExitCode::kInvalidInput, "model.empty", source.name,
                "no triangle is left: all faces have no area or non-finite vertices",
                "check the model in a viewer and export it again");
  }
  normalise(mesh);
  keep_used_materials(source, mesh);
  report_counts(source.name, counts, mesh.triangles.size(), report);
  timer.done(mesh.source_face_count, mesh.positions.size());
  return mesh;
}

Result<TriMesh> weld(const SourceModel& source, Report& report, const WeldOptions& options) {
  return weld(SourceModel(source), report, options);
}

}  // namespace modar
