// The image type of the workstation, and its way in and out of files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/error.hpp"

namespace modar {

/// 8-bit RGBA pixels, sRGB, top row first, without padding.
struct RgbaImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> pixels;  ///< width * height * 4
};

/// Reads PNG, JPEG, TGA, BMP, WebP, TIFF through OpenCV; EXIF orientation applied; grey, palette,
/// 16-bit become 8-bit RGBA. The size in the file's header is held against the limit before
/// anything is allocated. Errors: kIo "io.open"; kInvalidInput "image.decode", "image.too-large".
Result<RgbaImage> read_image(const std::string& path);
/// The same from a file's bytes; `name` is what errors call it.
Result<RgbaImage> decode_image(std::span<const std::byte> bytes, const std::string& name);

/// Levels from the image itself down to 1x1, each side max(1, floor(side / 2)), filtered in linear
/// light (sRGB-correct), colours weighted by alpha. repeat: the filter reaches across the edges, as
/// a texture that repeats does.
std::vector<RgbaImage> mip_chain(const RgbaImage& image, bool repeat = false, unsigned jobs = 1);

/// Writes an image as PNG (atomically: a temporary file beside it, renamed). Errors: kIo
/// "io.write".
Result<void> write_png(const RgbaImage& image, const std::string& path);

/// Mean over R, G, B; 99 where the images are equal.
double psnr_db(const RgbaImage& a, const RgbaImage& b);

}  // namespace modar
