// libFuzzer target: any bytes as a PLY or STL file give a model whose indices hold, or a coded
// error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bake/import/read_model.hpp"
#include "bake/mesh/upright.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace modar;
  using test::need;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const Result<SourceModel> model =
      bytes.starts_with("ply") ? parse_ply(bytes, "fuzz.ply") : parse_stl(bytes, "fuzz.stl");
  if (!model) {
    test::need_told(model.error());
    return 0;
  }
  need(model->colours.empty() || model->colours.size() == model->positions.size());
  for (std::size_t i = 0; i < model->corner_count(); ++i) {
    const Corner corner = model->corner(i);
    need(corner.position < model->positions.size());
    need(corner.uv == kNoIndex || corner.uv < model->uvs.size());
    need(corner.normal == kNoIndex || corner.normal < model->normals.size());
  }
  for (const FaceRun& run : model->material_runs) need(run.value < model->materials.size());
  Report report;
  const Result<TriMesh> mesh = weld(*model, report);
  if (!mesh) {
    test::need_told(mesh.error());
    return 0;
  }
  for (const auto& triangle : mesh->triangles) {
    for (const std::uint32_t v : triangle) need(v < mesh->positions.size());
  }
  find_up(*mesh);
  return 0;
}
