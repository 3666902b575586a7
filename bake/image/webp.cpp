// Still WebP images through libwebp.
#include <algorithm>
#include <cmath>
#include <memory>

#include <webp/decode.h>
#include <webp/demux.h>
#include <webp/encode.h>

#include "bake/image/decoders.hpp"
#include "bake/image/resample.hpp"

namespace modar {
namespace {

/// The bytes of a chunk; empty where it is missing.
std::vector<std::byte> chunk_of(const WebPData& data, const char* kind) {
  const std::unique_ptr<WebPDemuxer, void (*)(WebPDemuxer*)> demuxer(WebPDemux(&data),
                                                                     &WebPDemuxDelete);
  WebPChunkIterator chunk{};
  if (!demuxer || WebPDemuxGetChunk(demuxer.get(), kind, 1, &chunk) == 0) return {};
  const auto bytes = std::as_bytes(std::span(chunk.chunk.bytes, chunk.chunk.size));
  std::vector<std::byte> copy(bytes.begin(), bytes.end());
  WebPDemuxReleaseChunkIterator(&chunk);
  return copy;
}

/// libwebp's quality of previews: lower blurs more, higher leaves fewer pixels in the same bytes.
/// [15, 60]
constexpr float kPreviewQuality = 30;
/// Bytes: larger previews are sharper, and delay the first find on slow lines. [5000, 30000]
constexpr std::size_t kPreviewBytes = 15'000;

RgbaImage on_white(RgbaImage image) {
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const unsigned alpha = image.pixels[i + 3];
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint8_t& value = image.pixels[i + c];
      value = static_cast<std::uint8_t>((value * alpha + 255 * (255 - alpha) + 127) / 255);
    }
    image.pixels[i + 3] = 255;
  }
  return image;
}

}  // namespace

Result<std::vector<std::byte>> encode_preview(const RgbaImage& image, std::uint32_t width,
                                              std::uint32_t height) {
  const auto resized = [&](const RgbaImage& from, double longest) {
    const double shrink = std::min(1.0, longest / std::max(width, height));
    const auto side = [shrink](std::uint32_t length) {
      return std::max(1u, static_cast<std::uint32_t>(std::lround(length * shrink)));
    };
    return resize(from, side(width), side(height), {});
  };
  const bool empty = image.pixels.empty() || width == 0 || height == 0;
  const RgbaImage whole = empty ? RgbaImage{} : on_white(resized(image, 512));
  for (double longest = empty ? 0 : 512; longest >= 128; longest -= 32) {
    const RgbaImage small = resized(whole, longest);
    std::uint8_t* buffer = nullptr;
    const std::size_t size = WebPEncodeRGBA(
        small.pixels.data(), static_cast<int>(small.width), static_cast<int>(small.height),
        static_cast<int>(4 * small.width), kPreviewQuality, &buffer);
    const std::unique_ptr<std::uint8_t, void (*)(void*)> owner(buffer, &WebPFree);
    if (size == 0) break;
    const auto bytes = std::as_bytes(std::span(buffer, size));
    if (size <= kPreviewBytes) return std::vector<std::byte>(bytes.begin(), bytes.end());
  }
  return fail(ExitCode::kInternal, "image.encode", "WebP", "no preview could be encoded",
              "report this as a bug");
}

Result<StoredImage> decode_webp(std::span<const std::byte> bytes, const std::string& name) {
  const WebPData data = {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
  WebPBitstreamFeatures features;
  if (WebPGetFeatures(data.bytes, data.size, &features) != VP8_STATUS_OK) {
    return damaged_image(name, "the WebP header is damaged or cut short");
  }
  if (features.has_animation != 0) {
    return fail(ExitCode::kInvalidInput, "image.decode", name, "this WebP file is an animation",
                "save one of its frames");
  }
  const auto width = static_cast<std::uint32_t>(features.width);
  const auto height = static_cast<std::uint32_t>(features.height);
  MODAR_TRY(check_image_size(width, height, bytes.size(), name));
  StoredImage stored;
  allocate_pixels(stored.image, width, height);
  if (WebPDecodeRGBAInto(data.bytes, data.size, stored.image.pixels.data(),
                         stored.image.pixels.size(), features.width * 4) == nullptr) {
    return damaged_image(name, "the WebP data is damaged or cut short");
  }
  stored.exif = exif_facts(chunk_of(data, "EXIF"));
  stored.colours.profile = chunk_of(data, "ICCP");
  return stored;
}

}  // namespace modar
