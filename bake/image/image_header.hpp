// What an image file says of itself before anything is decoded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "formats/error.hpp"

namespace modar {

enum class ImageFormat : std::uint8_t { kPng, kJpeg, kBmp, kTga, kWebp, kTiff };

struct ImageHeader {
  ImageFormat format = ImageFormat::kPng;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  /// Which corner of the picture the first pixel is: 1-8 of EXIF, 1 where the file does not say. As
  /// read from PNG and WebP; JPEG's and TIFF's is left to their decoder.
  unsigned orientation = 1;
};

/// Larger images are refused: each side, in pixels. Both at their limit make 1 GiB of RGBA.
inline constexpr std::uint32_t kMaxImageSide = 16384;

/// Reads format and size, and holds them against the limit and the number of bytes that are there.
/// Errors: kInvalidInput "image.decode" (unknown format, size 0, truncated), "image.too-large".
Result<ImageHeader> read_image_header(std::span<const std::byte> bytes, const std::string& name);

/// The orientation that an EXIF block (a TIFF header and its first directory) states; 1: none.
unsigned exif_orientation(std::span<const std::byte> bytes);

}  // namespace modar
