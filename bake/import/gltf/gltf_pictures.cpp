// Multiplies, adds and cuts off pixel by pixel.
#include "bake/import/gltf/gltf_pictures.hpp"

#include <algorithm>
#include <cmath>

#include "bake/image/resample.hpp"
#include "formats/base/colour.hpp"

namespace modar {
namespace {

/// Share of glTF's occlusion that darkens a colour, which lamps light as well as the surroundings.
constexpr double kOccludedShare = 0.5;

/// A picture at the size of another, where it has a path.
Result<RgbaImage> read_as_large(const std::string& path, const RgbaImage& other) {
  if (path.empty()) return RgbaImage();
  MODAR_ASSIGN(RgbaImage image, read_texture(path));
  if (image.width == other.width && image.height == other.height) return image;
  return resize(image, other.width, other.height, {.wrap = kWrapRepeat});
}

/// Linear light of each value.
std::array<double, 256> linear_of_bytes() {
  RgbaImage ramp = {256, 1, std::vector<std::uint8_t>(std::size_t{4} * 256, 255)};
  for (std::size_t i = 0; i < 256; ++i) ramp.pixels[4 * i] = static_cast<std::uint8_t>(i);
  const LinearImage light = to_linear(ramp);
  std::array<double, 256> linear{};
  for (std::size_t i = 0; i < 256; ++i) {
    linear[i] = static_cast<double>(light.pixels[4 * i]) / (1 + double{LinearImage::kAlphaFloor});
  }
  return linear;
}

std::uint8_t alpha_of(const GltfPictures& pictures, std::uint8_t alpha) {
  switch (pictures.alpha) {
    case GltfPictures::Alpha::kIgnored:
      return 255;
    case GltfPictures::Alpha::kCutOff:
      return alpha / 255.0 * pictures.colour_factor[3] >= pictures.cutoff ? 255 : 0;
    case GltfPictures::Alpha::kKept:
      break;
  }
  return alpha;
}

}  // namespace

double stored_light(double linear) {
  return srgb_of_linear(std::clamp(linear, 0.0, 1.0));
}

Result<std::optional<RgbaImage>> fold_pictures(const GltfPictures& pictures) {
  const bool emits = !pictures.emissive.empty();
  const bool alone = !emits && pictures.occlusion.empty();
  if (alone && (pictures.colour.empty() || pictures.alpha == GltfPictures::Alpha::kKept)) {
    return std::nullopt;
  }
  MODAR_ASSIGN(RgbaImage image, read_texture(pictures.first()));
  if (alone && is_opaque(image) && alpha_of(pictures, 255) == 255) return std::nullopt;
  if (pictures.colour.empty()) std::fill(image.pixels.begin(), image.pixels.end(), 255);
  MODAR_ASSIGN(const RgbaImage emissive, read_as_large(pictures.emissive, image));
  MODAR_ASSIGN(const RgbaImage occlusion, read_as_large(pictures.occlusion, image));
  const std::array<double, 256> linear = linear_of_bytes();
  for (std::size_t p = 0; p < image.pixels.size(); p += 4) {
    std::uint8_t* pixel = &image.pixels[p];
    pixel[3] = alpha_of(pictures, pixel[3]);
    if (alone) continue;
    double seen = 1;
    if (!occlusion.pixels.empty()) {
      seen -= kOccludedShare * pictures.occlusion_strength * (1 - occlusion.pixels[p] / 255.0);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      double light = linear[pixel[i]] * seen;
      if (emits) {
        light = light * pictures.colour_factor[i] +
                linear[emissive.pixels[p + i]] * pictures.emissive_factor[i];
      }
      pixel[i] = static_cast<std::uint8_t>(std::lround(255 * stored_light(light)));
    }
  }
  return image;
}

}  // namespace modar
