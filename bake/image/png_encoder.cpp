// Writes PNG files (ISO/IEC 15948): signature, IHDR, one IDAT, IEND; rows filtered with Sub.
#include "bake/image/png_encoder.hpp"

#include <zlib.h>

#include <algorithm>

namespace modar {
namespace {

void put_u32(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>((value >> shift) & 0xFFu);
}

void put_chunk(std::string& out, const char* type, const std::string& data) {
  put_u32(out, static_cast<std::uint32_t>(data.size()));
  const std::string body = type + data;
  out += body;
  put_u32(out, static_cast<std::uint32_t>(::crc32(0, reinterpret_cast<const Bytef*>(body.data()),
                                                  static_cast<uInt>(body.size()))));
}

}  // namespace

std::string encode_png(const RgbaImage& image) {
  if (image.width == 0 || image.height == 0) return {};
  bool alpha = false;
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) alpha = alpha || image.pixels[i] != 255;
  const std::size_t channels = alpha ? 4 : 3;
  std::string rows;
  rows.reserve(image.height * (image.width * channels + 1));
  for (std::uint32_t y = 0; y < image.height; ++y) {
    rows += '\1';
    const std::uint8_t* row = image.pixels.data() + std::size_t{4} * image.width * y;
    for (std::uint32_t x = 0; x < image.width; ++x) {
      for (std::size_t c = 0; c < channels; ++c) {
        const unsigned left = x == 0 ? 0u : row[4 * (x - 1) + c];
        rows += static_cast<char>(static_cast<std::uint8_t>(row[4 * std::size_t{x} + c] - left));
      }
    }
  }
  uLongf size = ::compressBound(rows.size());
  std::string packed(size, '\0');
  if (::compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                  reinterpret_cast<const Bytef*>(rows.data()), rows.size(), 6) != Z_OK) {
    return {};
  }
  packed.resize(size);
  std::string header;
  put_u32(header, image.width);
  put_u32(header, image.height);
  header += '\x08';
  header += alpha ? '\x06' : '\x02';
  header.append(3, '\0');
  std::string out = "\x89PNG\r\n\x1A\n";
  put_chunk(out, "IHDR", header);
  put_chunk(out, "IDAT", packed);
  put_chunk(out, "IEND", {});
  return out;
}

}  // namespace modar
