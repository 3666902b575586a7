// What must hold of a model that a reader has given.
#pragma once

#include <cstdint>

#include "bake/import/source_model.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "tests/fuzz/need.hpp"

namespace modar::test {

/// Every index names something, before the weld and after it.
inline void need_whole(const SourceModel& model) {
  need(model.colours.empty() || model.colours.size() == model.positions.size());
  for (std::size_t i = 0; i < model.corner_count(); ++i) {
    const Corner corner = model.corner(i);
    need(corner.position < model.positions.size());
    need(corner.uv == kNoIndex || corner.uv < model.uvs.size());
    need(corner.normal == kNoIndex || corner.normal < model.normals.size());
  }
  for (const FaceRun& run : model.material_runs) need(run.value < model.materials.size());
  Report report;
  const Result<TriMesh> mesh = weld(model, report);
  if (!mesh) {
    need_told(mesh.error());
    return;
  }
  for (const auto& triangle : mesh->triangles) {
    for (const std::uint32_t v : triangle) need(v < mesh->positions.size());
  }
}

}  // namespace modar::test
