// libFuzzer target: any bytes as a camera file give a camera that can be used, or a coded error.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "modar/camera_file.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  static modar::test::InputFile file("fuzz.yml");
  const modar::Result<modar::Camera> camera = modar::read_camera_file(file.write(data, size));
  if (!camera) {
    modar::test::need_told(camera.error());
    return 0;
  }
  need(camera->fx > 0 && std::isfinite(camera->fx) && camera->fy > 0 && std::isfinite(camera->fy));
  need(std::isfinite(camera->cx) && std::isfinite(camera->cy));
  for (const double k : camera->distortion) need(std::isfinite(k));
  need(camera->width >= 0 && camera->height >= 0);
  return 0;
}
