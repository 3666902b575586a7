// Polygons to welded triangles in [-1,1]: picks one of two ways, normalises, reports dropped and
// created elements.
#include "bake/mesh/weld/weld.hpp"

#include <algorithm>
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
#include "bake/mesh/weld/normals.hpp"
#include "bake/mesh/weld/triangulate.hpp"
#include "formats/base/parallel.hpp"

namespace modar {
namespace {

struct WeldCounts {
  std::uint64_t flat = 0;        ///< triangles without area
  std::uint64_t not_finite = 0;  ///< triangles with a nan
  std::uint64_t tangled = 0;     ///< polygons
  MadeNormals normals;
};

/// Twice the area vector of a triangle, in doubles.
glm::dvec3 area_vector(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return glm::cross(b - a, c - a);
}

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
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

/// Runs over the faces once: triangulates, drops, welds.
class Welder {
 public:
  Welder(SourceModel& source, TriMesh& mesh, WeldCounts& counts)
      : source_(source), mesh_(mesh), counts_(counts), weld_(source.positions.size()) {}

  void run() {
    const std::size_t faces = source_.face_count();
    // One triangle a face, two less than corners in all: exact except for dropped triangles.
    const std::size_t triangles = source_.corner_count() - 2 * faces;
    mesh_.triangles.reserve(triangles);
    mesh_.triangle_material.reserve(triangles);
    RunCursor materials(source_.material_runs);
    for (std::size_t f = 0; f < faces; ++f) {
      material_ = materials.at(f);
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
    for (std::size_t v = 0; v < count && !source_.vertex_bones.empty(); ++v) {
      mesh_.vertex_bones.push_back(source_.vertex_bones[keys[v].position]);
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
    for (std::size_t v = 0; v < keys.size(); ++v) {
      mesh_.normals[v] = glm::normalize(source_.normals[keys[v].normal]);
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
    for (std::size_t i = 0; i < 3; ++i) out[i] = weld_.vertex(corners[i]);
    mesh_.triangles.push_back(out);
    mesh_.triangle_material.push_back(material_);
  }

  SourceModel& source_;
  TriMesh& mesh_;
  WeldCounts& counts_;
  VertexWeld weld_;
  std::uint32_t material_ = 0;
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
      for (int i = 0; i < 3; ++i) __atomic_store_n(&used[v[i]], 1, __ATOMIC_RELAXED);
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

/// Removes positions that no triangle uses; `to` holds the new numbers of the others. copies: the
/// position that each of the last ones is a copy of.
void drop_unused(SourceModel& source, const Array<std::uint8_t>& used,
                 const Array<std::uint32_t>& copies, TriMesh& mesh) {
  const bool all = std::find(used.begin(), used.end(), std::uint8_t{0}) == used.end();
  if (all && copies.empty()) return;
  const std::size_t own = used.size() - copies.size();
  Array<std::uint32_t> to(used.size());
  for (std::size_t i = 0; i < used.size(); ++i) {
    to[i] = static_cast<std::uint32_t>(mesh.source_positions.size());
    if (used[i] == 0) continue;
    mesh.source_positions.push_back(i < own ? static_cast<std::uint32_t>(i) : copies[i - own]);
  }
  if (all) return;
  for (std::uint32_t& v : source.corner_positions) v = to[v];
  keep_elements(source.positions, used);
  keep_elements(source.normals, used);
  keep_elements(source.uvs, used);
  keep_elements(source.colours, used);
  keep_elements(source.vertex_bones, used);
}

void weld_identity_indices(SourceModel& source, TriMesh& mesh, WeldCounts& counts, unsigned jobs) {
  if (source.corner_uvs.kind == IndexPlane::Kind::kAbsent) source.uvs.release();
  // No corner refers to elements beyond the last position.
  if (!source.uvs.empty()) source.uvs.resize(source.positions.size());
  source.normals.resize(source.positions.size());
  Array<std::uint8_t> used;
  keep_triangles(source, classify(source, used, jobs), mesh, counts);
  if (mesh.triangle_material.empty()) return;
  drop_unused(source, used, counts.normals.from, mesh);
  used.release();
  mesh.triangles = Array<std::array<std::uint32_t, 3>>::regroup(std::move(source.corner_positions));
  mesh.normals = std::move(source.normals);
  parallel_stretches(mesh.normals.size(), jobs, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) mesh.normals[v] = glm::normalize(mesh.normals[v]);
  });
  mesh.uvs = std::move(source.uvs);
  for (glm::dvec2& uv : mesh.uvs) uv = image_uv(uv);
  mesh.colours.resize(source.colours.size());
  for (std::size_t v = 0; v < mesh.colours.size(); ++v) {
    mesh.colours[v] = byte_colour(source.colours[v]);
  }
  source.colours.release();
  mesh.vertex_bones = std::move(source.vertex_bones);
  mesh.positions = std::move(source.positions);
}

// Picking the way, and what both share.

constexpr double kLeastFloat = std::numeric_limits<float>::min();

/// Normalises the positions to [-1,1]; the model's largest side fills it. Coordinates below
/// the smallest normal float become zero.
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
    for (int i = 0; i < 3; ++i) p[i] = std::fabs(p[i]) < kLeastFloat ? 0.0 : p[i];
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

std::uint64_t count_polygons(const SourceModel& source) {
  std::uint64_t count = 0;
  for (std::size_t f = 0; f + 1 < source.first_corner.size(); ++f) {
    count += source.face_size(f) > 3 ? 1u : 0u;
  }
  return count;
}

/// What the readers counted, with faces, and materials without faces.
Account account_of(const SourceModel& source, const WeldCounts& counts, std::uint64_t polygons,
                   const TriMesh& mesh) {
  Account account = source.account;
  account.model = mesh.name;
  Fate& colours = account.colours;
  const std::uint64_t stated = colours.used + colours.changed;
  const std::uint64_t unused = stated - std::min<std::uint64_t>(stated, mesh.materials.size());
  colours.left_out = std::min(unused, colours.used);
  colours.used -= colours.left_out;
  const std::uint64_t triangles = mesh.source_face_count - polygons;
  const std::uint64_t lost = std::min(counts.not_finite + counts.flat, triangles);
  account.faces = {triangles - lost, polygons, source.lost_faces + lost};
  return account;
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
  add(counts.normals.bad, "model.bad-normal", DiagnosticSeverity::kInfo,
      "corners have a normal of length 0", "normals were computed for them");
  add(counts.normals.made, "model.made-normals", DiagnosticSeverity::kInfo,
      counts.normals.noise ? "normals were computed from the faces; most sharp edges end in "
                             "nothing, as the noise of scans does, and are smoothed"
                           : "normals were computed from the faces",
      "");
}

/// Shares of a file's faces whose loss is reported last, and is an error.
constexpr double kToldLoss = 0.05;
constexpr double kFatalLoss = 0.5;

Result<void> account_for_faces(const std::string& name, std::uint64_t lost, std::uint64_t all,
                               Report& report) {
  const double share = all == 0 ? 0 : static_cast<double>(lost) / static_cast<double>(all);
  const std::string what = with_numbers("{} of {} faces could not be used", {lost, all});
  const char* const cure = "export the model again; the notes above name their faults";
  if (share > kFatalLoss) {
    return fail(ExitCode::kInvalidInput, "model.mostly-lost", name, what, cure);
  }
  if (share > kToldLoss) {
    report.diagnostics.push_back({"model.lost", DiagnosticSeverity::kWarning, name, 0, what, cure});
  }
  return {};
}

}  // namespace

Result<TriMesh> weld(SourceModel&& source, Report& report, const WeldOptions& options) {
  StageTimer timer(report, "weld");
  TriMesh mesh;
  mesh.name = source.name;
  mesh.up = source.up;
  mesh.source_vertex_count = source.positions.size();
  mesh.source_face_count = source.face_count();
  const std::uint64_t polygons = count_polygons(source);
  WeldCounts counts;
  counts.normals = make_normals(source, options.crease);
  if (has_identity_indices(source)) {
    weld_identity_indices(source, mesh, counts, options.jobs);
  } else {
    weld_any(source, mesh, counts);
  }
  if (mesh.triangles.empty()) {
    return no_triangle_left(source.name, "all faces have no area or non-finite vertices");
  }
  MODAR_TRY(account_for_faces(source.name, source.lost_faces + counts.not_finite,
                              source.lost_faces + mesh.source_face_count, report));
  normalise(mesh);
  keep_used_materials(source, mesh);
  report.accounts.push_back(account_of(source, counts, polygons, mesh));
  report_counts(source.name, counts, mesh.triangles.size(), report);
  timer.done(mesh.source_face_count, mesh.positions.size());
  return mesh;
}

Result<TriMesh> weld(const SourceModel& source, Report& report, const WeldOptions& options) {
  return weld(SourceModel(source), report, options);
}

}  // namespace modar
