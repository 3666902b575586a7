// libFuzzer target: any bytes as the tracks of a clip are refused, or give finite places at any
// time.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "formats/clip_tracks.hpp"
#include "tests/fuzz/need.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Words of their own: aligned, and the sanitizer watches their end.
  std::vector<std::uint32_t> words((size + 3) / 4);
  if (size > 0) std::memcpy(words.data(), data, size);
  modar::ClipTracksView view;
  const auto bytes = std::as_bytes(std::span(words)).first(size);
  if (modar::view_clip_tracks(bytes, 64, view) != nullptr) return 0;
  const auto last = static_cast<float>(view.header->sample_count - 1);
  for (const modar::TrackRecord& track : view.tracks) {
    std::uint32_t key = static_cast<std::uint32_t>(size);
    for (const float part : {0.0f, 0.7f, 0.2f, 1.0f}) {
      for (const float value : view.at(track, part * last, key)) {
        modar::test::need(std::isfinite(value));
      }
    }
  }
  return 0;
}
