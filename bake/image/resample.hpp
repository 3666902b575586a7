// Images in linear light, and their change of size.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/image/image.hpp"

namespace modar {

/// Linear light, top row first, four floats a pixel: red, green, blue, each times (alpha +
/// kAlphaFloor), and alpha, all for white = 1. The floor keeps the colour
/// of transparent pixels; 1/4096 is a sixteenth of the smallest alpha that shows, 1/255, and leaves
/// colours half of a float's 24 bits.
struct LinearImage {
  static constexpr float kAlphaFloor = 1.0F / 4096;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool opaque = true;  ///< alpha is 1 everywhere
  std::vector<float> pixels;
};

/// How resample() treats the world beyond the edges, and how many threads it takes.
struct ResampleOptions {
  TextureWrap wrap{};  ///< what the filter finds there
  unsigned jobs = 1;   ///< the result does not depend on it
};

/// Any image that read_image() reads, or a Radiance HDR (RGBE), whose alpha is 1 without the floor.
/// Errors: as read_image() and decode_image().
Result<LinearImage> read_linear_image(const std::string& path);
Result<LinearImage> decode_linear_image(std::span<const std::byte> bytes, const std::string& name);

LinearImage to_linear(const RgbaImage& image);
RgbaImage to_srgb(const LinearImage& image);

/// The image at another size (each side 1 or more). Opaque images: Catmull-Rom's cubic, as wide as
/// the pixels of the smaller of both sizes; others: a tent, which has no negative lobes that would
/// take colour from where there is no alpha.
LinearImage resample(const LinearImage& image, std::uint32_t width, std::uint32_t height,
                     const ResampleOptions& options);

/// to_srgb(resample(to_linear(image))), bit for bit, in the memory of a few rows: a picture of
/// 8192² pixels takes 1 GB in floats.
RgbaImage resize(const RgbaImage& image, std::uint32_t width, std::uint32_t height,
                 const ResampleOptions& options);

}  // namespace modar
