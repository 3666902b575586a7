// libFuzzer target: any text as a golden recording gives frames that can be compared, or the line
// that is wrong.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "runtime/play/recording.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  static modar::test::InputFile file("poses.jsonl");
  const std::string& path = file.write(data, size);
  const auto recording = modar::read_recording(path.substr(0, path.rfind('/')));
  if (!recording) {
    modar::test::need_told(recording.error());
    return 0;
  }
  need(recording->head.camera.width >= 0 && recording->head.camera.height >= 0);
  for (const modar::RecordedFrame& frame : recording->frames) {
    for (const auto& seen : frame.visible) {
      for (const auto& corner : seen.corners) need(std::isfinite(corner.x + corner.y));
    }
  }
  return 0;
}
