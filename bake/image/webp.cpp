// Still WebP images through libwebp.
#include <memory>

#include <webp/decode.h>
#include <webp/demux.h>

#include "bake/image/decoders.hpp"

namespace modar {
namespace {

ExifFacts exif_of(const WebPData& data) {
  const std::unique_ptr<WebPDemuxer, void (*)(WebPDemuxer*)> demuxer(WebPDemux(&data),
                                                                     &WebPDemuxDelete);
  WebPChunkIterator chunk{};
  if (!demuxer || WebPDemuxGetChunk(demuxer.get(), "EXIF", 1, &chunk) == 0) return {};
  const ExifFacts facts = exif_facts(std::as_bytes(std::span(chunk.chunk.bytes, chunk.chunk.size)));
  WebPDemuxReleaseChunkIterator(&chunk);
  return facts;
}

}  // namespace

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
  MODAR_TRY(check_image_size(width, height, name));
  StoredImage stored;
  allocate_pixels(stored.image, width, height);
  if (WebPDecodeRGBAInto(data.bytes, data.size, stored.image.pixels.data(),
                         stored.image.pixels.size(), features.width * 4) == nullptr) {
    return damaged_image(name, "the WebP data is damaged or cut short");
  }
  stored.exif = exif_of(data);
  return stored;
}

}  // namespace modar
