// One texture from its file to measured levels of compressed blocks.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>

#include "bake/image/difference.hpp"
#include "bake/image/resample.hpp"
#include "bake/texture/coverage.hpp"
#include "bake/texture/texture.hpp"
#include "formats/base/path.hpp"
#include "formats/layout.hpp"

namespace modar {
namespace {

/// PSNR below which small images are encoded enlarged as well. Lower: palettes get wrong colours;
/// higher: bundles grow for what few people see. [30, 40]
constexpr double kPoorPsnr = 36;
/// Gain for which the enlarged one is stored, in sixteen times the bytes. [3, 10] dB
constexpr double kEnlargedGain = 6;

std::uint32_t nearest_power(std::uint32_t side, std::uint32_t limit) {
  const std::uint64_t below = std::bit_floor(side);
  const bool up = std::uint64_t{side} * side > below * below * 2;
  return std::min(static_cast<std::uint32_t>(up ? below * 2 : below), std::bit_floor(limit));
}

std::uint64_t pixel_count(const RgbaImage& image) {
  return std::uint64_t{image.width} * image.height;
}

RgbaImage resized(const RgbaImage& image, const TextureOptions& options) {
  const TextureSize size = texture_size({image.width, image.height}, options);
  if (size.width == image.width && size.height == image.height) return image;
  return resize(image, size.width, size.height, {texture_wrap(options.wrap), options.jobs});
}

/// Whether all texels that are shown look the same.
bool is_constant(const RgbaImage& image, std::array<std::uint8_t, 4>& colour) {
  std::copy_n(image.pixels.begin(), 4, colour.begin());
  for (std::size_t i = 4; i < image.pixels.size(); i += 4) {
    if (!std::equal(colour.begin(), colour.end(), &image.pixels[i])) return false;
  }
  return true;
}

/// Alpha as a gray image: the twin.
RgbaImage alpha_twin(const RgbaImage& image) {
  RgbaImage twin{image.width, image.height, std::vector<std::uint8_t>(image.pixels.size(), 255)};
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    std::fill_n(&twin.pixels[i], 3, image.pixels[i + 3]);
  }
  return twin;
}

TextureLevel encode_level(const RgbaImage& image, bool alpha, const TextureOptions& texture) {
  const EncodeOptions options = {texture.effort, texture.perceptual, texture.jobs};
  const TextureCodec& codec = texture_codec(texture.format);
  TextureLevel level;
  level.width = image.width;
  level.height = image.height;
  level.colour = codec.encode(image, options);
  if (alpha) level.alpha = codec.encode(alpha_twin(image), options);
  const RgbaImage decoded = decode_texture(texture.format, level.colour, level.width, level.height);
  level.psnr_db = psnr_db(image, decoded);
  level.ssim = ssim(image, decoded);
  const WorstBlock worst = worst_block(image, decoded);
  level.worst_x = worst.x;
  level.worst_y = worst.y;
  level.worst_psnr_db = worst.psnr_db;
  return level;
}

/// Nearly all texels are there or not: leaves, fences, letters. The soft rims of such pictures take
/// up to 6 % of the texels; a tenth is let pass. Where more is soft than there, as in a shadow with
/// wide clear margins, it would be lost.
bool is_cut_out(const RgbaImage& image) {
  std::size_t there = 0;
  std::size_t soft = 0;
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
    there += image.pixels[i] > 229 ? 1U : 0U;
    soft += image.pixels[i] >= 26 && image.pixels[i] <= 229 ? 1U : 0U;
  }
  return 10 * soft <= image.pixels.size() / 4 && soft <= there;
}

/// The share of texels whose alpha is at least 1/2 after a factor.
double covered(const RgbaImage& image, double factor) {
  std::size_t count = 0;
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
    count += factor * image.pixels[i] >= 127.5 ? 1U : 0U;
  }
  return static_cast<double>(count) / (static_cast<double>(image.pixels.size()) / 4);
}

/// Scales a coarser level's alpha so that as large a share is covered as at the finest one: else
/// leaves vanish with distance. Castano, "Computing Alpha Mipmaps", 2010.
void keep_coverage(double share, RgbaImage& level) {
  double low = 0;
  double high = 8;
  for (int i = 0; i < 16; ++i) {
    const double middle = (low + high) / 2;
    (covered(level, middle) < share ? low : high) = middle;
  }
  for (std::size_t i = 3; i < level.pixels.size(); i += 4) {
    level.pixels[i] =
        static_cast<std::uint8_t>(std::lround(std::min(255.0, high * level.pixels[i])));
  }
}

/// The images of all levels, ready to encode.
std::vector<RgbaImage> make_levels(const RgbaImage& source, const TextureOptions& options,
                                   Texture& texture) {
  RgbaImage top = resized(source, options);
  if (options.coverage) {
    fill_uncovered(top, resize_coverage(*options.coverage, top.width, top.height));
  }
  texture.alpha = !is_opaque(top);
  if (texture.alpha) fill_transparent(top);
  texture.constant = is_constant(top, texture.constant_rgba);
  if (texture.constant) {
    top = {1, 1, {texture.constant_rgba.begin(), texture.constant_rgba.end()}};
    return {top};
  }
  std::vector<RgbaImage> levels = options.mipmaps
                                      ? mip_chain(top, texture_wrap(options.wrap), options.jobs)
                                      : std::vector<RgbaImage>{std::move(top)};
  texture.cut_out = texture.alpha && is_cut_out(levels.front());
  if (texture.cut_out) {
    const double share = covered(levels.front(), 1);
    for (std::size_t i = 1; i < levels.size(); ++i) keep_coverage(share, levels[i]);
  }
  if (!options.coverage) return levels;
  for (RgbaImage& level : levels) {
    flatten_uncovered_blocks(level, resize_coverage(*options.coverage, level.width, level.height));
  }
  return levels;
}

/// Each pixel as a square of kEnlarged pixels: one block of ETC1.
RgbaImage enlarged(const RgbaImage& image) {
  RgbaImage large{kEnlarged * image.width, kEnlarged * image.height, {}};
  large.pixels.reserve(image.pixels.size() * kEnlarged * kEnlarged);
  for (std::uint32_t y = 0; y < large.height; ++y) {
    for (std::uint32_t x = 0; x < large.width; ++x) {
      const std::size_t at = std::size_t{y / kEnlarged} * image.width + x / kEnlarged;
      const std::uint8_t* pixel = &image.pixels[4 * at];
      large.pixels.insert(large.pixels.end(), pixel, pixel + 4);
    }
  }
  return large;
}

/// Fills texture.levels; the images that they show.
std::vector<RgbaImage> encode_levels(const RgbaImage& source, const TextureOptions& options,
                                     Texture& texture, Report& report) {
  StageTimer mip_timer(report, "texture.mips");
  std::vector<RgbaImage> images = make_levels(source, options, texture);
  std::uint64_t pixels = 0;
  for (const RgbaImage& image : images) pixels += pixel_count(image);
  mip_timer.done(pixel_count(source), pixels);

  StageTimer encode_timer(report,
                          "texture." + std::string(texture_codec(options.format).format.name));
  std::uint64_t bytes = 0;
  texture.levels.clear();
  for (const RgbaImage& image : images) {
    texture.levels.push_back(encode_level(image, texture.alpha, options));
    bytes += texture.levels.back().colour.size() + texture.levels.back().alpha.size();
  }
  encode_timer.done(pixels, bytes);
  return images;
}

/// A number with two decimals.
std::string decimals(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

/// The gate: says so where level 0 is worse than asked.
void judge(const std::string& path, const TextureLevel& level, const TextureOptions& options,
           Report& report) {
  const bool bad_psnr = options.min_psnr_db > 0 && level.psnr_db < options.min_psnr_db;
  const bool bad_ssim = options.min_ssim > 0 && level.ssim < options.min_ssim;
  if (!bad_psnr && !bad_ssim) return;
  report.diagnostics.push_back(
      {"texture.quality", DiagnosticSeverity::kWarning, path, 0,
       "compressed it has " + decimals(level.psnr_db) + " dB and SSIM " + decimals(level.ssim) +
           "; its worst block, at pixel " + std::to_string(level.worst_x) + "," +
           std::to_string(level.worst_y) + ", has " + decimals(level.worst_psnr_db) + " dB",
       "bake it larger or with more effort, or lower the threshold"});
}

Result<void> write_picture(const RgbaImage& image, const Texture& texture,
                           const TextureOptions& options) {
  if (options.picture_folder.empty()) return {};
  const TextureLevel& level = texture.levels.front();
  const RgbaImage decoded = decode_texture(texture.format, level.colour, level.width, level.height);
  return write_png(quality_picture(image, decoded),
                   options.picture_folder + "/" + texture.name + ".png");
}

}  // namespace

TextureSize texture_size(TextureSize source, const TextureOptions& options) {
  if (options.mipmaps || options.wrap != 0) {
    return {nearest_power(source.width, options.max_side),
            nearest_power(source.height, options.max_side)};
  }
  const std::uint64_t longer = std::max(source.width, source.height);
  if (longer <= options.max_side) return source;
  const auto scaled = [&](std::uint64_t side) {
    return static_cast<std::uint32_t>(
        std::max<std::uint64_t>(1, (side * options.max_side * 2 + longer) / (2 * longer)));
  };
  return {scaled(source.width), scaled(source.height)};
}

bool can_be_enlarged(TextureSize source, std::uint32_t max_side) {
  constexpr std::uint64_t kMostPixels = 64 * 64;  // 44 KB enlarged, with mips
  return std::uint64_t{source.width} * source.height <= kMostPixels &&
         kEnlarged * std::max(source.width, source.height) <= max_side;
}

Result<Texture> bake_texture(const std::string& path, const TextureOptions& options,
                             Report& report) {
  StageTimer timer(report, "texture.read");
  MODAR_ASSIGN(const RgbaImage source, read_texture(path));
  timer.done(1, pixel_count(source));
  return bake_texture(source, path, options, report);
}

Result<Texture> bake_texture(const RgbaImage& source, const std::string& path,
                             const TextureOptions& options, Report& report) {
  if (options.max_side == 0 || options.max_side > kMaxTextureSide) {
    return fail(ExitCode::kUsage, "texture.max-side", std::to_string(options.max_side),
                "a texture's longest side must be from 1 to " + std::to_string(kMaxTextureSide),
                "choose another");
  }
  Texture texture;
  texture.name = file_name(path);
  texture.format = options.format;
  texture.source_width = source.width;
  texture.source_height = source.height;
  texture.wrap = options.wrap;
  std::vector<RgbaImage> images = encode_levels(source, options, texture, report);
  const double psnr = texture.levels.front().psnr_db;
  if (psnr < kPoorPsnr && can_be_enlarged({source.width, source.height}, options.max_side)) {
    Texture larger = texture;
    std::vector<RgbaImage> larger_images = encode_levels(enlarged(source), options, larger, report);
    if (larger.levels.front().psnr_db >= psnr + kEnlargedGain) {
      report.diagnostics.push_back(
          {"texture.enlarged", DiagnosticSeverity::kInfo, path, 0,
           "stored " + std::to_string(kEnlarged) +
               " times as large, since blocks of 4 x 4 pixels mix its colours: " +
               decimals(larger.levels.front().psnr_db) + " dB instead of " + decimals(psnr),
           ""});
      texture = std::move(larger);
      images = std::move(larger_images);
    }
  }
  judge(path, texture.levels.front(), options, report);
  MODAR_TRY(write_picture(images.front(), texture, options));
  return texture;
}

}  // namespace modar
