// Polygons to welded triangles in [-1,1]: picks the way, normalises, tells what was dropped or
// made.
#include <algorithm>
#include <limits>

#include <glm/common.hpp>

#include "bake/mesh/weld/weld_steps.hpp"

namespace modar {
namespace {

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

void report_counts(const std::string& name, const WeldCounts& counts, Report& report) {
  const auto add = [&](std::uint64_t count, const char* id, DiagnosticSeverity severity,
                       const char* message, const char* cure) {
    if (count == 0) return;
    report.findings.push_back({id, severity, name, 0, std::to_string(count) + " " + message, cure});
  };
  add(counts.flat, "model.degenerate", DiagnosticSeverity::kInfo, "triangles without area left out",
      "");
  add(counts.not_finite, "model.not-finite", DiagnosticSeverity::kWarning,
      "triangles with vertices at no finite place left out", "export the model again");
  add(counts.tangled, "model.tangled-polygon", DiagnosticSeverity::kWarning,
      "polygons cross themselves or are too large to cut well",
      "triangulate the model before export");
  add(counts.bad_normals, "model.bad-normal", DiagnosticSeverity::kInfo,
      "corners have a normal without direction", "normals were made for them");
  add(counts.made_normals, "model.made-normals", DiagnosticSeverity::kInfo,
      "normals were made from the faces", "");
}

}  // namespace

Result<TriMesh> weld(SourceModel&& source, Report& report, const WeldOptions& options) {
  StageTimer timer(report, "weld");
  TriMesh mesh;
  mesh.name = source.name;
  mesh.source_vertex_count = source.positions.size();
  mesh.source_face_count = source.face_count();
  WeldCounts counts;
  if (can_weld_directly(source)) {
    weld_identity_indices(source, mesh, counts, options.jobs);
  } else {
    weld_any(source, mesh, counts);
  }
  if (mesh.triangles.empty()) {
    return fail(ExitCode::kInvalidInput, "model.empty", source.name,
                "no triangle is left: all faces are without area or at no finite place",
                "check the model in a viewer and export it again");
  }
  normalise(mesh);
  keep_used_materials(source, mesh);
  report_counts(source.name, counts, report);
  timer.done(mesh.source_face_count, mesh.positions.size());
  return mesh;
}

Result<TriMesh> weld(const SourceModel& source, Report& report, const WeldOptions& options) {
  return weld(SourceModel(source), report, options);
}

}  // namespace modar
