// libFuzzer target: any bytes as a glTF or GLB file give a model whose indices hold, or a coded
// error.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "bake/import/read_model.hpp"
#include "bake/mesh/weld/weld.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace modar;
  using test::need;
  static test::InputFile file("fuzz.gltf");
  Result<SourceModel> model = read_gltf(file.write(data, size));
  if (!model) {
    test::need_told(model.error());
    return 0;
  }
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
  return 0;
}
