// libFuzzer target: any bytes as a PLY or STL file give a model whose indices hold, or a coded
// error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bake/import/read_model.hpp"
#include "tests/fuzz/whole_model.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace modar;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const Result<SourceModel> model =
      bytes.starts_with("ply") ? parse_ply(bytes, "fuzz.ply") : parse_stl(bytes, "fuzz.stl");
  if (!model) {
    test::need_told(model.error());
    return 0;
  }
  test::need_whole(*model);
  return 0;
}
