// The weld of files whose corners repeat one index: scans mostly do. Works in the source's arrays.
#include <algorithm>
#include <atomic>
#include <vector>

#include "bake/mesh/weld/normal_maker.hpp"
#include "bake/mesh/weld/weld_steps.hpp"
#include "bake/parallel.hpp"

namespace modar {
namespace {

constexpr std::size_t kStretch = 1u << 16;  ///< elements that one thread takes at a time

std::uint32_t stretches(std::size_t count) {
  return static_cast<std::uint32_t>((count + kStretch - 1) / kStretch);
}

/// Calls body(begin, end) over [0, count) in stretches, on several threads.
template <class Body>
void parallel_stretches(std::size_t count, unsigned jobs, const Body& body) {
  parallel_rows(stretches(count), jobs, [&](std::uint32_t s) {
    const std::size_t begin = s * kStretch;
    body(begin, std::min(begin + kStretch, count));
  });
}

enum class Verdict : std::uint8_t { kKeep, kFlat, kNotFinite };

/// What to do with each triangle; marks the positions of those that stay.
Array<Verdict> judge(const SourceModel& source, Array<std::uint8_t>& used, unsigned jobs) {
  const std::size_t count = source.face_count();
  Array<Verdict> verdicts(count);
  used.assign(source.positions.size(), 0);
  parallel_stretches(count, jobs, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const std::uint32_t* v = source.corner_positions.data() + 3 * t;
      const glm::dvec3 area =
          area_vector(source.positions[v[0]], source.positions[v[1]], source.positions[v[2]]);
      verdicts[t] = !is_finite(area)          ? Verdict::kNotFinite
                    : area == glm::dvec3(0.0) ? Verdict::kFlat
                                              : Verdict::kKeep;
      if (verdicts[t] != Verdict::kKeep) continue;
      // Threads may mark one position at a time, all with the same value.
      for (int i = 0; i < 3; ++i) {
        std::atomic_ref<std::uint8_t>(used[v[i]]).store(1, std::memory_order_relaxed);
      }
    }
  });
  return verdicts;
}

/// Takes dropped triangles out and lists the materials of the rest.
void keep_triangles(SourceModel& source, const Array<Verdict>& verdicts, TriMesh& mesh,
                    WeldCounts& counts) {
  RunCursor materials(source.material_runs);
  mesh.triangle_material.resize(verdicts.size());
  std::uint32_t* corners = source.corner_positions.data();
  std::size_t kept = 0;
  for (std::size_t t = 0; t < verdicts.size(); ++t) {
    const std::uint32_t material = materials.at(t);
    if (verdicts[t] != Verdict::kKeep) {
      ++(verdicts[t] == Verdict::kFlat ? counts.flat : counts.not_finite);
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

/// Takes positions out that no triangle uses; `to` is where the others went.
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

/// Normals round each position, for sources that have none.
void make_normals(const SourceModel& source, TriMesh& mesh, WeldCounts& counts) {
  NormalMaker maker;
  maker.reset(source.positions.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& v = mesh.triangles[t];
    const std::array<glm::dvec3, 3> p = {source.positions[v[0]], source.positions[v[1]],
                                         source.positions[v[2]]};
    const glm::dvec3 area = area_vector(p[0], p[1], p[2]);
    for (std::size_t i = 0; i < 3; ++i) {
      maker.add(v[i], area, p[i], p[(i + 1) % 3], p[(i + 2) % 3]);
    }
  }
  const Array<glm::dvec3> made = maker.take_normals();
  counts.made_normals = made.size();
  mesh.normals.resize(made.size());
  for (std::size_t v = 0; v < made.size(); ++v) mesh.normals[v] = glm::vec3(made[v]);
}

}  // namespace

bool can_weld_directly(const SourceModel& source) {
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
  // What lies beyond the last position no corner refers to.
  if (!source.uvs.empty()) source.uvs.resize(source.positions.size());
  if (!source.normals.empty()) source.normals.resize(source.positions.size());
  Array<std::uint8_t> used;
  keep_triangles(source, judge(source, used, jobs), mesh, counts);
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

}  // namespace modar
