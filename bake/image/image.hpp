// The image type of the workstation, its files, and its change of size: the door of bake/image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/sections.hpp"

namespace modar {

/// 8-bit RGBA pixels, sRGB, alpha not multiplied in, top row first, without padding.
struct RgbaImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> pixels;  ///< width * height * 4
};

/// Whether the alpha of every pixel is 255.
bool is_opaque(const RgbaImage& image);

/// kStored: unchanged, whatever the file states, as glTF prescribes and maps of data need.
enum class Colours : std::uint8_t { kSrgb, kStored };

/// Larger images are refused before they are decoded. Pixels a side.
inline constexpr std::uint32_t kMaxImageSide = 16384;
/// Pixels that a file of any size may have: 256 MiB of RGBA.
inline constexpr std::uint64_t kMaxImagePixels = std::uint64_t{1} << 26;
/// Pixels per byte of a file at most. Lower refuses large plain textures; higher lets small files
/// take 1 GiB.
inline constexpr std::uint64_t kMaxPixelsPerByte = 64;

/// Reads PNG (libpng), JPEG (libjpeg-turbo), WebP (libwebp), TIFF (libtiff), BMP and TGA
/// (stb_image) as upright 8-bit RGBA: EXIF orientation is applied; gray, palette, CMYK and 16-bit
/// images are converted, as are the colours of ICC profiles (RGB and gray) and of a PNG's gAMA and
/// cHRM. The size that a header states is checked before anything is allocated; a truncated or
/// damaged file is an error, never a partial image.
/// Errors: kIo "io.open"; kInvalidInput "image.decode", "image.too-large"; kUnsupported
/// "image.ktx", "image.format", both with the command that converts the file.
Result<RgbaImage> read_image(const std::string& path, Colours colours = Colours::kSrgb);
/// The same of a model's texture: rows as the file stores them, since its coordinates refer to
/// these, in Blender and in engines alike.
Result<RgbaImage> read_texture(const std::string& path, Colours colours = Colours::kSrgb);
/// read_image() from a file's bytes; `name` is what errors call it.
Result<RgbaImage> decode_image(std::span<const std::byte> bytes, const std::string& name,
                               Colours colours = Colours::kSrgb);
/// Whether read_image() gives other pixels than the file stores, as it states other colours.
bool states_other_colours(const std::string& path);

/// Whether a file's name ends as those of the formats do that read_image() reads, in either case.
bool is_picture_file(const std::string& path);
/// The same of formats that read_image() names and does not read.
bool is_foreign_picture_file(const std::string& path);

/// A picture that a camera took.
struct Photo {
  RgbaImage image;
  double focal_px = 0;  ///< focal length in pixels by its EXIF block; 0: not stated, or cropped
};

/// As read_image(), with what the camera wrote of its lens.
Result<Photo> read_photo(const std::string& path);

/// A PNG file: 8-bit RGB, or RGBA where any pixel is not opaque. width_mm: the physical width of
/// what the picture shows, stored as its resolution (pHYs); 0: not stored. Errors: kInternal
/// "image.encode" where the image is empty.
Result<std::vector<std::byte>> encode_png(const RgbaImage& image, double width_mm = 0);
/// The same to a file, atomically. Errors: also kIo "io.write".
Result<void> write_png(const RgbaImage& image, const std::string& path, double width_mm = 0);
/// The physical width that a PNG file's pHYs states, in mm; 0: none, no readable PNG file, or 72,
/// 96 or 144 pixels per inch, which programs write by default.
double png_width_mm(const std::string& path);

/// A progressive JPEG file without the alpha. quality: 1 to 100, as libjpeg counts. Errors:
/// kInternal "image.encode" where the image is empty or has a side above 65500 pixels.
Result<std::vector<std::byte>> encode_jpeg(const RgbaImage& image, int quality);

/// A small WebP file of the picture, for people: of the proportions of width x height, at most 512
/// pixels a side, and smaller where it would have more than 15 KB. Transparent pixels show white
/// paper. Errors: kInternal "image.encode".
Result<std::vector<std::byte>> encode_preview(const RgbaImage& image, std::uint32_t width,
                                              std::uint32_t height);

/// Levels from the image itself down to 1x1, each side max(1, floor(side / 2)), filtered in linear
/// light (sRGB-correct), colours weighted by alpha. The filter finds beyond the edges what
/// the texture shows there.
std::vector<RgbaImage> mip_chain(const RgbaImage& image, const TextureWrap& wrap = {},
                                 unsigned jobs = 1);

}  // namespace modar
