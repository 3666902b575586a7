// libFuzzer target: any text as a gyroscope's record gives finite turns, or the line that is wrong.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "runtime/play/gyroscope.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static modar::test::InputFile file("turns.txt");
  const auto turns = modar::read_gyroscope(file.write(data, size));
  if (!turns) {
    modar::test::need_told(turns.error());
    return 0;
  }
  for (const glm::dvec3& turn : *turns) {
    modar::test::need(std::isfinite(turn.x + turn.y + turn.z));
  }
  return 0;
}
