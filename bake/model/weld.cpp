// Polygons to welded triangles: one vertex a distinct (position, uv, normal) index triple.
#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "bake/model/normal_maker.hpp"
#include "bake/model/tri_mesh.hpp"
#include "bake/model/triangulate.hpp"

namespace modar {
namespace {

/// Marks the number of a made normal in a vertex key; source normals stay below it.
constexpr std::uint32_t kMade = 0x80000000u;

/// Vertices by index triple. They hang in a list at their position: corners that share a position
/// stand near each other in files, so no hash is needed but for hubs with very many vertices.
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

  [[nodiscard]] const std::vector<Corner>& keys() const { return keys_; }

 private:
  static constexpr std::uint32_t kMaxSteps = 64;

  std::uint32_t add(const Corner& key) {
    const auto v = static_cast<std::uint32_t>(keys_.size());
    keys_.push_back(key);
    next_.push_back(first_[key.position]);
    first_[key.position] = v;
    return v;
  }

  /// Long lists are indexed by a hash; only looked up, so its order shows nowhere.
  std::uint32_t from_hub(const Corner& key) {
    auto& hub = hubs_[key.position];
    if (hub.empty()) {
      for (std::uint32_t v = first_[key.position]; v != kNoIndex; v = next_[v]) {
        hub.emplace(key_of(keys_[v]), v);
      }
    }
    const auto [at, fresh] = hub.try_emplace(key_of(key), 0);
    if (fresh) at->second = add(key);
    return at->second;
  }

  static std::uint64_t key_of(const Corner& c) { return (std::uint64_t{c.uv} << 32) | c.normal; }

  std::vector<std::uint32_t> first_;  // of each position
  std::vector<std::uint32_t> next_;   // of each vertex
  std::vector<Corner> keys_;          // of each vertex
  std::unordered_map<std::uint32_t, std::unordered_map<std::uint64_t, std::uint32_t>> hubs_;
};

struct WeldCounts {
  std::uint64_t flat = 0;         ///< triangles without area
  std::uint64_t not_finite = 0;   ///< triangles with a nan
  std::uint64_t tangled = 0;      ///< polygons
  std::uint64_t bad_normals = 0;  ///< corners whose normal has no direction
};

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Runs over the faces once: triangulates, drops, gathers normals, welds.
class Welder {
 public:
  Welder(const SourceModel& source, TriMesh& mesh)
      : source_(source), mesh_(mesh), weld_(source.positions.size()) {
    mesh_.triangles.reserve(source.corners.size() / 2);
    mesh_.triangle_material.reserve(source.corners.size() / 2);
  }

  void run() {
    for (std::size_t f = 0; f < source_.face_count(); ++f) face(f);
  }

  /// Fills the mesh's vertex arrays.
  void finish() {
    const std::vector<Corner>& keys = weld_.keys();
    const std::vector<glm::dvec3> made = normals_.take_normals();
    bool any_uv = false;
    for (const Corner& key : keys) any_uv = any_uv || key.uv != kNoIndex;
    mesh_.positions.reserve(keys.size());
    mesh_.source_position.reserve(keys.size());
    mesh_.normals.reserve(keys.size());
    if (any_uv) mesh_.uvs.reserve(keys.size());
    for (const Corner& key : keys) {
      mesh_.positions.push_back(source_.positions[key.position]);
      mesh_.source_position.push_back(key.position);
      mesh_.normals.push_back((key.normal & kMade) != 0
                                  ? made[key.normal & ~kMade]
                                  : glm::normalize(source_.normals[key.normal]));
      if (any_uv) mesh_.uvs.push_back(uv(key.uv));
      if (!source_.colours.empty()) mesh_.colours.push_back(colour(key.position));
    }
    made_normals_ = made.size();
  }

  [[nodiscard]] const WeldCounts& counts() const { return counts_; }
  [[nodiscard]] std::uint64_t made_normals() const { return made_normals_; }

 private:
  [[nodiscard]] glm::dvec2 uv(std::uint32_t index) const {
    if (index == kNoIndex) return glm::dvec2(0.0, 1.0);
    const glm::dvec2 uv = source_.uvs[index];
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return glm::dvec2(0.0, 1.0);
    return {uv.x, 1.0 - uv.y};
  }

  [[nodiscard]] glm::u8vec4 colour(std::uint32_t position) const {
    const glm::vec3 c = source_.colours[position] * 255.0f + 0.5f;
    return {static_cast<std::uint8_t>(c.x), static_cast<std::uint8_t>(c.y),
            static_cast<std::uint8_t>(c.z), std::uint8_t{255}};
  }

  void face(std::size_t f) {
    const std::uint32_t first = source_.first_corner[f];
    const std::uint32_t count = source_.first_corner[f + 1] - first;
    flat_ = kNoIndex;
    if (count == 3) {
      triangle(f, first, {0, 1, 2});
      return;
    }
    polygon_.clear();
    for (std::uint32_t i = 0; i < count; ++i) {
      polygon_.push_back(source_.positions[source_.corners[first + i].position]);
    }
    triangles_.clear();
    if (!triangulate(polygon_, triangles_)) ++counts_.tangled;
    for (const auto& t : triangles_) triangle(f, first, t);
  }

  void triangle(std::size_t f, std::uint32_t first, const std::array<std::uint32_t, 3>& t) {
    const std::array<Corner, 3> corners = {source_.corners[first + t[0]],
                                           source_.corners[first + t[1]],
                                           source_.corners[first + t[2]]};
    std::array<glm::dvec3, 3> p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = source_.positions[corners[i].position];
    const glm::dvec3 cross = glm::cross(p[1] - p[0], p[2] - p[0]);
    if (!is_finite(cross)) {
      ++counts_.not_finite;
      return;
    }
    if (cross == glm::dvec3(0.0)) {
      ++counts_.flat;
      return;
    }
    std::array<std::uint32_t, 3> out{};
    for (std::size_t i = 0; i < 3; ++i) {
      Corner key = corners[i];
      if (!has_normal(key)) {
        const std::uint32_t node = normal_node(f, key.position);
        normals_.add(node, cross, p[i], p[(i + 1) % 3], p[(i + 2) % 3]);
        key.normal = kMade | node;
      }
      out[i] = weld_.vertex(key);
    }
    mesh_.triangles.push_back(out);
    mesh_.triangle_material.push_back(source_.face_material[f]);
  }

  bool has_normal(const Corner& corner) {
    if (corner.normal == kNoIndex) return false;
    const glm::dvec3& n = source_.normals[corner.normal];
    const double square = glm::dot(n, n);
    if (square > 1e-200 && square < 1e200) return true;
    ++counts_.bad_normals;
    return false;
  }

  std::uint32_t normal_node(std::size_t f, std::uint32_t position) {
    const std::uint32_t group = source_.face_smoothing[f];
    if (group != 0) return normals_.node(position, group, source_.positions.size());
    if (flat_ == kNoIndex) flat_ = normals_.flat_node();
    return flat_;
  }

  const SourceModel& source_;
  TriMesh& mesh_;
  VertexWeld weld_;
  NormalMaker normals_;
  WeldCounts counts_;
  std::uint64_t made_normals_ = 0;
  std::uint32_t flat_ = kNoIndex;  // the normal of the face at hand, where it is flat
  std::vector<glm::dvec3> polygon_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

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

/// Keeps the materials that triangles use, in their order.
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

void report_counts(const SourceModel& source, const Welder& welder, Report& report) {
  const auto add = [&](std::uint64_t count, const char* id, FindingSeverity severity,
                       const char* message, const char* cure) {
    if (count == 0) return;
    report.findings.push_back(
        {id, severity, source.name, 0, std::to_string(count) + " " + message, cure});
  };
  const WeldCounts& counts = welder.counts();
  add(counts.flat, "model.degenerate", FindingSeverity::kInfo, "triangles without area left out",
      "");
  add(counts.not_finite, "model.not-finite", FindingSeverity::kWarning,
      "triangles with vertices at no finite place left out", "export the model again");
  add(counts.tangled, "model.tangled-polygon", FindingSeverity::kWarning,
      "polygons cross themselves or are too large to cut well",
      "triangulate the model before export");
  add(counts.bad_normals, "model.bad-normal", FindingSeverity::kInfo,
      "corners have a normal without direction", "normals were made for them");
  add(welder.made_normals(), "model.made-normals", FindingSeverity::kInfo,
      "normals were made from the faces", "");
}

}  // namespace

Result<TriMesh> weld(const SourceModel& source, Report& report) {
  StageTimer timer(report, "weld");
  TriMesh mesh;
  mesh.name = source.name;
  mesh.source_vertex_count = source.positions.size();
  mesh.source_face_count = source.face_count();
  Welder welder(source, mesh);
  welder.run();
  if (mesh.triangles.empty()) {
    return fail(ExitCode::kInvalidInput, "model.empty", source.name,
                "no triangle is left: all faces are without area or at no finite place",
                "check the model in a viewer and export it again");
  }
  welder.finish();
  normalise(mesh);
  keep_used_materials(source, mesh);
  report_counts(source, welder, report);
  timer.done(source.face_count(), mesh.positions.size());
  return mesh;
}

}  // namespace modar
