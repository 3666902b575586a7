// libFuzzer target: any bytes as a camera file give a camera that can be used, or a coded error,
// with the desk's reader and with the device's.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "modar/camera_file.hpp"
#include "modar/camera_yml.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

namespace {

void need_usable(const modar::Result<modar::Camera>& camera) {
  using modar::test::need;
  if (!camera) {
    modar::test::need_told(camera.error());
    return;
  }
  need(camera->fx > 0 && std::isfinite(camera->fx) && camera->fy > 0 && std::isfinite(camera->fy));
  need(std::isfinite(camera->cx) && std::isfinite(camera->cy));
  for (const double k : camera->distortion) need(std::isfinite(k));
  need(camera->width >= 0 && camera->height >= 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static modar::test::InputFile file("fuzz.yml");
  const std::string& path = file.write(data, size);
  need_usable(modar::read_camera_file(path));
  need_usable(modar::read_camera_yml(path));
  return 0;
}
