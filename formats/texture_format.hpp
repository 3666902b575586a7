// What the formats of compressed textures are to a reader of bundles, to GL and to a device.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "formats/etc1.hpp"
#include "formats/layout.hpp"

namespace modar {

/// One of the formats that a bundle's textures can have.
struct TextureFormatInfo {
  TextureFormat format;
  std::string_view name;
  std::uint32_t block_side;  ///< pixels; blocks are square
  std::uint32_t block_bytes;
  std::uint32_t gl_format;        ///< internalformat of glCompressedTexImage2D
  std::string_view gl_extension;  ///< by which OpenGL ES 2.0 reads it
  std::uint32_t core_since;       ///< OpenGL ES that reads it without the extension: 30 for 3.0
  /// To pixels of 3 or 4 bytes, as decode_etc1() does, for contexts that cannot read the format.
  void (*decode)(std::span<const std::byte> blocks, std::uint32_t width, std::uint32_t height,
                 std::size_t pixel_bytes, std::span<std::uint8_t> pixels);

  /// Bytes of an image's blocks, in rows; the last ones may reach beyond its edges.
  [[nodiscard]] constexpr std::uint64_t bytes(std::uint64_t width, std::uint64_t height) const {
    return (width + block_side - 1) / block_side * ((height + block_side - 1) / block_side) *
           block_bytes;
  }
};

inline constexpr std::array kTextureFormats = {
    TextureFormatInfo{TextureFormat::kEtc1Rgb, "etc1", 4, 8, 0x8D64,
                      "GL_OES_compressed_ETC1_RGB8_texture", 30, decode_etc1},
};

/// The format of a TextureRecord; null where this version knows none of that number.
constexpr const TextureFormatInfo* find_texture_format(std::uint32_t format) {
  for (const TextureFormatInfo& info : kTextureFormats) {
    if (static_cast<std::uint32_t>(info.format) == format) return &info;
  }
  return nullptr;
}

}  // namespace modar
