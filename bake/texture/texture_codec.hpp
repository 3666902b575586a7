// The door to texture codecs: encode and decode an image's blocks, and what the format needs of
// GL. ETC1 (bake/texture/etc1) is one; CONTRIBUTING.md says how to add another.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/image/image.hpp"
#include "formats/texture_format.hpp"

namespace modar {

/// Time against quality; `modar-lab bench etc1` measures both.
enum class TextureEffort : std::uint8_t { kFast, kGood, kBest };

struct EncodeOptions {
  TextureEffort effort = TextureEffort::kGood;
  bool perceptual = false;  ///< minimise errors weighted like luma; else those of RGB alike
  unsigned jobs = 1;        ///< threads; the bytes do not depend on it
};

struct TextureCodec {
  /// Size of blocks, GL's format, the extension that reads it, the decoder.
  TextureFormatInfo format;
  /// Blocks of an image's colours, format.bytes(width, height) of them, in rows; edge pixels are
  /// repeated to fill blocks. Alpha is ignored: a texture with alpha has a second, gray image. The
  /// same on every processor.
  std::vector<std::byte> (*encode)(const RgbaImage& image, const EncodeOptions& options);
};

/// The codec of a format.
const TextureCodec& texture_codec(TextureFormat format);

/// The pixels of blocks, alpha 255.
RgbaImage decode_texture(TextureFormat format, std::span<const std::byte> blocks,
                         std::uint32_t width, std::uint32_t height);

}  // namespace modar
