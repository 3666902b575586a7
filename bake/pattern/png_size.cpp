// The physical size that a PNG states (pHYs), written and read.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>

#include <zlib.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/rectify.hpp"
#include "formats/atomic_file.hpp"

namespace modar {
namespace {

constexpr std::array<std::uint8_t, 8> kPngMagic = {0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A};
constexpr std::size_t kHeaderEnd = 8 + 12 + 13;  // magic and IHDR
constexpr std::size_t kReadLimit = 65536;        // pHYs comes before the pixels

std::uint32_t read_u32(const std::uint8_t* bytes) {
  return (std::uint32_t{bytes[0]} << 24) | (std::uint32_t{bytes[1]} << 16) |
         (std::uint32_t{bytes[2]} << 8) | std::uint32_t{bytes[3]};
}

void append_u32(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) {
    bytes.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

std::vector<std::uint8_t> phys_chunk(std::uint32_t pixels_per_metre) {
  std::vector<std::uint8_t> chunk;
  append_u32(chunk, 9);
  for (const char letter : {'p', 'H', 'Y', 's'}) chunk.push_back(static_cast<std::uint8_t>(letter));
  append_u32(chunk, pixels_per_metre);
  append_u32(chunk, pixels_per_metre);
  chunk.push_back(1);  // unit: metre
  const uLong crc = crc32(0, chunk.data() + 4, static_cast<uInt>(chunk.size() - 4));
  append_u32(chunk, static_cast<std::uint32_t>(crc));
  return chunk;
}

Result<std::vector<std::uint8_t>> encode_png(const RgbaImage& image) {
  try {
    const cv::Mat rgba(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC4,
                       const_cast<std::uint8_t*>(image.pixels.data()));
    cv::Mat bgr;
    const bool opaque = [&] {
      for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
        if (image.pixels[i] != 255) return false;
      }
      return true;
    }();
    cv::cvtColor(rgba, bgr, opaque ? cv::COLOR_RGBA2BGR : cv::COLOR_RGBA2BGRA);
    std::vector<std::uint8_t> bytes;
    if (cv::imencode(".png", bgr, bytes) && bytes.size() > kHeaderEnd) return bytes;
    return fail(ExitCode::kInternal, "pattern.png", "", "the picture cannot be encoded as PNG",
                "report this as a bug");
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInternal, "pattern.png", "", thrown.what(), "report this as a bug");
  }
}

}  // namespace

Result<void> write_pattern_png(const RgbaImage& image, double width_mm, const std::string& path) {
  if (image.width == 0 || image.height == 0 ||
      image.pixels.size() != std::size_t{image.width} * image.height * 4) {
    return fail(ExitCode::kInternal, "pattern.png", path, "the picture is empty",
                "report this as a bug");
  }
  auto png = encode_png(image);
  if (!png) return tl::unexpected(png.error());
  const double per_metre = width_mm > 0 ? image.width * 1000.0 / width_mm : 0.0;
  if (per_metre >= 0.5 && per_metre < 2147483647.0) {
    const auto chunk = phys_chunk(static_cast<std::uint32_t>(std::lround(per_metre)));
    png->insert(png->begin() + static_cast<std::ptrdiff_t>(kHeaderEnd), chunk.begin(), chunk.end());
  }
  return write_file(path, std::as_bytes(std::span(*png)));
}

double read_width_mm(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> bytes(kReadLimit);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  if (bytes.size() < kHeaderEnd || !std::equal(kPngMagic.begin(), kPngMagic.end(), bytes.begin())) {
    return 0.0;
  }
  const double width = read_u32(bytes.data() + 16);
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    const std::size_t size = read_u32(bytes.data() + at);
    const std::uint8_t* type = bytes.data() + at + 4;
    if (std::memcmp(type, "IDAT", 4) == 0 || size > bytes.size() - at - 12) return 0.0;
    if (std::memcmp(type, "pHYs", 4) == 0 && size == 9) {
      const double per_metre = read_u32(type + 4);
      return per_metre > 0 && type[12] == 1 ? width * 1000.0 / per_metre : 0.0;
    }
    at += size + 12;
  }
  return 0.0;
}

}  // namespace modar
