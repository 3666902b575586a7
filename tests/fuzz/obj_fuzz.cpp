// libFuzzer target: any text as an OBJ file gives a model whose indices hold, or a coded error; and
// where several threads have work, their number changes nothing.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bake/import/read_model.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "tests/fuzz/need.hpp"

namespace {

using namespace modar;
using test::need;

void walk(const SourceModel& model) {
  const auto inside = [](std::uint32_t index, std::size_t size) {
    return index == kNoIndex || index < size;
  };
  for (std::size_t f = 0; f < model.face_count(); ++f) {
    need(model.face_first(f) + model.face_size(f) <= model.corner_count());
  }
  for (std::size_t i = 0; i < model.corner_count(); ++i) {
    const Corner corner = model.corner(i);
    need(corner.position < model.positions.size());
    need(inside(corner.uv, model.uvs.size()) && inside(corner.normal, model.normals.size()));
  }
  for (const FaceRun& run : model.material_runs) need(run.value < model.materials.size());
}

void walk(const TriMesh& mesh) {
  need(mesh.triangle_material.size() == mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) need(v < mesh.positions.size());
  }
  for (const glm::dvec3& p : mesh.positions) {
    for (int axis = 0; axis < 3; ++axis) need(p[axis] >= -1.0 && p[axis] <= 1.0);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const Result<SourceModel> model = parse_obj(text, "", "fuzz");
  if (size > kObjBlockBytes) {
    const Result<SourceModel> threads = parse_obj(text, "", "fuzz", {3});
    need(model.has_value() == threads.has_value());
    if (model) need(model->corner_count() == threads->corner_count());
  }
  if (!model) {
    need(!model.error().code.empty() && !model.error().cure.empty());
    return 0;
  }
  walk(*model);
  Report report;
  const Result<TriMesh> mesh = weld(*model, report);
  if (mesh) walk(*mesh);
  return 0;
}
