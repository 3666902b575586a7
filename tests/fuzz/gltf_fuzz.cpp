// libFuzzer target: any bytes as a glTF or GLB file give a model whose indices hold, or a coded
// error.
#include <cstddef>
#include <cstdint>

#include "bake/import/read_model.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/whole_model.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace modar;
  static test::InputFile file("fuzz.gltf");
  Result<SourceModel> model = read_gltf(file.write(data, size));
  if (!model) {
    test::need_told(model.error());
    return 0;
  }
  test::need_whole(*model);
  return 0;
}
