// libFuzzer target: any text as a scene, pattern, shape or length of an option gives numbers that
// can be baked with, or says what to write.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

#include "bake/options/request_text.hpp"
#include "tests/fuzz/need.hpp"

namespace {

template <typename T>
void need_cure(const modar::Result<T>& parsed) {
  if (!parsed) modar::test::need_told(parsed.error());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using modar::test::need;
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (const auto length = modar::parse_millimetres(text)) {
    need(std::isfinite(*length) && *length > 0);
  } else {
    need(!length.error().cause.empty() && !length.error().cure.empty());
  }
  const auto scene = modar::parse_scene(text);
  need_cure(scene);
  if (scene) need(!scene->pattern.empty() && !scene->model.empty());
  const auto pattern = modar::parse_pattern(text);
  need_cure(pattern);
  if (pattern) need(std::isfinite(pattern->width_mm) && pattern->width_mm >= 0);
  if (const auto corners = modar::parse_corners(text)) {
    for (const modar::PixelPoint& corner : *corners) need(std::isfinite(corner.x + corner.y));
  }
  need_cure(modar::parse_shape(text));
  need_cure(modar::parse_up(text));
  need_cure(modar::parse_unit(text));
  need_cure(modar::parse_max_error(text));
  return 0;
}
