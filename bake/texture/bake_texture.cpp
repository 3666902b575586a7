// One texture from its file to measured levels of ETC1 blocks.
#include <algorithm>
#include <bit>
#include <cmath>

#include "bake/texture/etc1_texture.hpp"
#include "bake/texture/resample.hpp"
#include "bake/texture/texture_quality.hpp"

namespace modar {
namespace {

constexpr std::uint32_t kMaxTextureSideOption = 8192;  // formats' kMaxTextureSide

/// The power of two that is nearest as a ratio, at most `limit` (itself rounded down to one).
std::uint32_t nearest_power(std::uint32_t side, std::uint32_t limit) {
  const std::uint64_t below = std::bit_floor(side);
  const bool up = std::uint64_t{side} * side > below * below * 2;
  return std::min(static_cast<std::uint32_t>(up ? below * 2 : below), std::bit_floor(limit));
}

struct Size {
  std::uint32_t width;
  std::uint32_t height;
};

Size target_size(const RgbaImage& image, const TextureOptions& options) {
  if (options.mipmaps || options.repeat) {
    return {nearest_power(image.width, options.max_side),
            nearest_power(image.height, options.max_side)};
  }
  const std::uint64_t longer = std::max(image.width, image.height);
  if (longer <= options.max_side) return {image.width, image.height};
  const auto scaled = [&](std::uint64_t side) {
    return static_cast<std::uint32_t>(
        std::max<std::uint64_t>(1, (side * options.max_side * 2 + longer) / (2 * longer)));
  };
  return {scaled(image.width), scaled(image.height)};
}

RgbaImage resized(const RgbaImage& image, const TextureOptions& options) {
  const Size size = target_size(image, options);
  if (size.width == image.width && size.height == image.height) return image;
  return to_srgb(
      resample(to_linear(image), size.width, size.height, {options.repeat, options.jobs}));
}

bool has_alpha(const RgbaImage& image) {
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
    if (image.pixels[i] != 255) return true;
  }
  return false;
}

/// Alpha as a grey image: the twin.
RgbaImage alpha_twin(const RgbaImage& image) {
  RgbaImage twin{image.width, image.height, std::vector<std::uint8_t>(image.pixels.size(), 255)};
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    std::fill_n(&twin.pixels[i], 3, image.pixels[i + 3]);
  }
  return twin;
}

Etc1Level encode_level(const RgbaImage& image, bool alpha, unsigned jobs) {
  Etc1Level level;
  level.width = image.width;
  level.height = image.height;
  level.colour = encode_etc1(image, jobs);
  if (alpha) level.alpha = encode_etc1(alpha_twin(image), jobs);
  const RgbaImage decoded = decode_etc1(level.colour, level.width, level.height);
  level.psnr_db = psnr_db(image, decoded);
  level.ssim = ssim(image, decoded);
  return level;
}

std::uint64_t pixel_count(const RgbaImage& image) {
  return std::uint64_t{image.width} * image.height;
}

std::string file_name(const std::string& path) {
  const std::size_t slash = path.find_last_of("/\\");
  return slash == std::string::npos ? path : path.substr(slash + 1);
}

}  // namespace

Result<Etc1Texture> bake_texture(const std::string& path, const TextureOptions& options,
                                 Report& report) {
  if (options.max_side == 0 || options.max_side > kMaxTextureSideOption) {
    return fail(ExitCode::kUsage, "texture.max-side", std::to_string(options.max_side),
                "a texture's greatest side must lie between 1 and 8192", "choose another");
  }
  StageTimer read_timer(report, "texture.read");
  const Result<RgbaImage> source = read_image(path);
  if (!source) return tl::unexpected(source.error());
  read_timer.done(1, pixel_count(*source));

  StageTimer mip_timer(report, "texture.mips");
  const RgbaImage top = resized(*source, options);
  const std::vector<RgbaImage> images =
      options.mipmaps ? mip_chain(top, options.repeat, options.jobs) : std::vector<RgbaImage>{top};
  std::uint64_t pixels = 0;
  for (const RgbaImage& image : images) pixels += pixel_count(image);
  mip_timer.done(pixel_count(*source), pixels);

  StageTimer encode_timer(report, "texture.etc1");
  Etc1Texture texture;
  texture.name = file_name(path);
  texture.source_width = source->width;
  texture.source_height = source->height;
  texture.repeat = options.repeat;
  texture.alpha = has_alpha(top);
  std::uint64_t bytes = 0;
  for (const RgbaImage& image : images) {
    texture.levels.push_back(encode_level(image, texture.alpha, options.jobs));
    bytes += texture.levels.back().colour.size() + texture.levels.back().alpha.size();
  }
  encode_timer.done(pixels, bytes);
  return texture;
}

}  // namespace modar
