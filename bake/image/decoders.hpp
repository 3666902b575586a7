// What the decoders of the image formats share. Internal to bake/image.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "bake/image/resample.hpp"

namespace modar {

/// Metadata that a camera wrote into a picture's file.
struct ExifFacts {
  /// Which corner of the picture the first pixel is: 1-8 as EXIF and TIFF count, 1: upright.
  unsigned orientation = 1;
  unsigned focal_35mm = 0;  ///< focal length on a frame of 36 x 24 mm, mm; 0: not stated
  /// Pixels when the picture was taken, as its file stores them; 0: not stated.
  unsigned width = 0;
  unsigned height = 0;
};

/// What a file says of its colours; nothing: they are sRGB.
struct StatedColours {
  std::vector<std::byte> profile;  ///< ICC, before the others
  double gamma = 0;                ///< a PNG's gAMA; 0: not stated
  bool has_primaries = false;
  /// x and y of white, red, green and blue, by a PNG's cHRM, or those of sRGB.
  std::array<double, 8> primaries{0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06};
};

/// Converts pixels; answers whether any colour may have changed: not where the file means sRGB, and
/// not by profiles that cannot be read or are of other kinds of colours.
bool convert_to_srgb(const StatedColours& stated, RgbaImage& image);

/// Pixels of four inks become opaque RGBA, by their ICC profile where it is one of such inks.
/// inverted: 255 is no ink.
void convert_inks(std::span<const std::byte> profile, bool inverted, RgbaImage& image);

/// An image as its file stores it.
struct StoredImage {
  RgbaImage image;
  StatedColours colours;
  ExifFacts exif;
};

/// The error "image.decode" of a file that is truncated or damaged.
inline tl::unexpected<Error> damaged_image(const std::string& name, std::string cause) {
  return fail(ExitCode::kInvalidInput, "image.decode", name, std::move(cause),
              "export the image again");
}

/// Called with the size that a header states, before anything of that size is allocated.
/// Errors: "image.too-large", "image.decode" where a side is 0.
Result<void> check_image_size(std::uint64_t width, std::uint64_t height, std::size_t file_bytes,
                              const std::string& name);

/// Of an EXIF block (a TIFF header, its first directory and that of the exposure); an "Exif\0\0"
/// before it is skipped. Damaged fields count as not stated.
ExifFacts exif_facts(std::span<const std::byte> exif);

/// Gives an image its pixels, uninitialised where a format's library fills all of them.
inline void allocate_pixels(RgbaImage& image, std::uint32_t width, std::uint32_t height) {
  image.width = width;
  image.height = height;
  image.pixels.resize(std::size_t{width} * height * 4);
}

/// A file in memory, as the read callbacks of libpng, libtiff and stb_image want it.
struct MemoryFile {
  std::span<const std::byte> bytes;
  std::size_t at = 0;

  /// Copies at most `count` bytes and answers how many there were.
  std::size_t read(void* to, std::size_t count) {
    const std::size_t copied = std::min(count, bytes.size() - at);
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), copied,
                static_cast<std::byte*>(to));
    at += copied;
    return copied;
  }
};

/// One decoder a library. The bytes begin with the format's signature (decode_stb(): BMP's or none,
/// as TGA files do). Errors: kInvalidInput "image.decode", "image.too-large".
Result<StoredImage> decode_png(std::span<const std::byte> bytes, const std::string& name);
Result<StoredImage> decode_jpeg(std::span<const std::byte> bytes, const std::string& name);
Result<StoredImage> decode_webp(std::span<const std::byte> bytes, const std::string& name);
Result<StoredImage> decode_tiff(std::span<const std::byte> bytes, const std::string& name);
Result<StoredImage> decode_stb(std::span<const std::byte> bytes, const std::string& name);

/// Radiance's signature.
inline bool is_radiance(std::span<const std::byte> bytes) {
  return bytes.size() > 2 && bytes[0] == std::byte{'#'} && bytes[1] == std::byte{'?'};
}
/// A Radiance HDR file (RGBE, -Y +X). Errors: as decode_stb().
Result<LinearImage> decode_radiance(std::span<const std::byte> bytes, const std::string& name);

}  // namespace modar
