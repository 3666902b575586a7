// libFuzzer target: any bytes as an image file give pixels or a coded error.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  const modar::Result<modar::LinearImage> light = modar::decode_linear_image(bytes, "fuzz");
  if (light && light->pixels.size() != std::size_t{4} * light->width * light->height) std::abort();
  const modar::Result<modar::RgbaImage> image = modar::decode_image(bytes, "fuzz");
  if (!image) {
    if (image.error().code.empty()) std::abort();
    return 0;
  }
  const std::size_t pixels = std::size_t{image->width} * image->height;
  if (pixels == 0 || image->pixels.size() != pixels * 4) std::abort();
  return 0;
}
