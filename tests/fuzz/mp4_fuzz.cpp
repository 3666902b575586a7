// libFuzzer target: any bytes as an MP4 file.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "formats/mp4.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  modar::Mp4Info info;
  const auto fault = modar::view_mp4(std::as_bytes(std::span(data, size)), info);
  if (fault && fault->offset > size) std::abort();
  if (!(info.seconds >= 0.0) || info.video_tracks < 0) std::abort();
  return 0;
}
