// The codecs of all texture formats.
#include "bake/texture/texture_codec.hpp"

#include <algorithm>
#include <array>

#include "bake/texture/etc1/etc1_encoder.hpp"

namespace modar {
namespace {

constexpr std::array kCodecs = {
    TextureCodec{*find_texture_format(static_cast<std::uint32_t>(TextureFormat::kEtc1Rgb)),
                 encode_etc1},
};
static_assert(kCodecs.size() == kTextureFormats.size(), "a format has no codec");

}  // namespace

const TextureCodec& texture_codec(TextureFormat format) {
  return *std::find_if(kCodecs.begin(), kCodecs.end(), [format](const TextureCodec& codec) {
    return codec.format.format == format;
  });
}

RgbaImage decode_texture(TextureFormat format, std::span<const std::byte> blocks,
                         std::uint32_t width, std::uint32_t height) {
  RgbaImage image{width, height, std::vector<std::uint8_t>(std::size_t{width} * height * 4, 255)};
  texture_codec(format).format.decode(blocks, width, height, 4, image.pixels);
  return image;
}

}  // namespace modar
