// libFuzzer target: any text as an image target of 8th Wall gives a shape, or a coded error.
#include <cstddef>
#include <cstdint>

#include "bake/pattern/target_file.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static modar::test::InputFile file("target.json");
  const std::string& path = file.write(data, size);
  const auto shape = modar::target_shape(path);
  if (!shape) modar::test::need_told(shape.error());
  const auto picture = modar::target_picture(path);
  if (!picture) modar::test::need_told(picture.error());
  return 0;
}
