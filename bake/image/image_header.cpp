// Size, completeness and orientation of PNG, JPEG, BMP, TGA, WebP and TIFF, from their bytes alone.
#include "bake/image/image_header.hpp"

#include <optional>
#include <string_view>

#include "bake/image/byte_reader.hpp"

namespace modar {
namespace {

using std::string_view_literals::operator""sv;

/// What a format's reader hands on; the limits are held against it afterwards.
struct Probe {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  unsigned orientation = 1;
  std::string_view damage;  ///< empty: none seen
};

constexpr std::string_view kTruncated = "the file ends before its image does";

Probe probe_png(const ByteReader& in) {
  Probe probe{in.u32(16), in.u32(20), 1, {}};
  if (!in.starts_with("IHDR", 12) || !in.has(0, 33)) {
    probe.damage = "it does not begin with an IHDR chunk";
    return probe;
  }
  for (std::size_t at = 8; in.has(at, 12);) {
    const std::size_t length = in.u32(at);
    if (in.starts_with("IEND", at + 4)) return probe;
    if (in.starts_with("eXIf", at + 4)) {
      probe.orientation = exif_orientation(in.part(at + 8, length));
    }
    if (!in.has(at + 12, length)) break;
    at += 12 + length;
  }
  probe.damage = kTruncated;
  return probe;
}

bool is_standalone(std::uint32_t marker) {
  return marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8);
}
bool is_frame(std::uint32_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

/// ITU-T T.81 annex B: segments up to the end marker; the coded data of a scan has no marker but
/// restarts and stuffed zeros.
Probe probe_jpeg(const ByteReader& in) {
  Probe probe;
  bool scan = false;
  std::size_t at = 2;
  while (in.has(at, 2)) {
    const std::uint32_t marker = in.u8(at + 1);
    if (in.u8(at) != 0xFF || marker == 0xFF || marker == 0) {
      at += marker == 0 && in.u8(at) == 0xFF ? 2U : 1U;
      continue;
    }
    if (marker == 0xD9) break;
    if (is_standalone(marker)) {
      at += 2;
      continue;
    }
    const std::size_t length = in.u16(at + 2);
    if (is_frame(marker) && length >= 8 && in.has(at, 10)) {
      probe.height = in.u16(at + 5);
      probe.width = in.u16(at + 7);
    }
    scan = scan || marker == 0xDA;
    at += 2 + length;
  }
  if (!in.has(at, 2)) probe.damage = kTruncated;
  if (!scan && probe.damage.empty()) probe.damage = "it holds no scan";
  return probe;
}

std::uint32_t magnitude(std::uint32_t twos_complement) {
  return twos_complement >> 31 ? 0U - twos_complement : twos_complement;
}

Probe probe_bmp(const ByteReader& in) {
  const std::uint32_t header = in.u32(14);
  if (header == 12) {
    Probe probe{in.u16(18), in.u16(20), 1, {}};
    if (!in.has(0, 26)) probe.damage = kTruncated;
    return probe;
  }
  Probe probe{in.u32(18), magnitude(in.u32(22)), 1, {}};
  if (header < 40 || !in.has(0, 54)) {
    probe.damage = kTruncated;
    return probe;
  }
  const std::uint32_t compression = in.u32(30);
  if (compression == 0 || compression == 3) {
    const std::uint64_t row = (std::uint64_t{probe.width} * in.u16(28) + 31) / 32 * 4;
    if (row * probe.height > in.size() - in.u32(10) || in.u32(10) > in.size()) {
      probe.damage = kTruncated;
    }
  }
  return probe;
}

/// Truevision TGA has no signature: this tells whether its fields make sense.
bool looks_like_tga(const ByteReader& in) {
  const std::uint32_t type = in.u8(2);
  const std::uint32_t depth = in.u8(16);
  const bool mapped = type == 1 || type == 9;
  const bool colour = type == 2 || type == 10;
  const bool gray = type == 3 || type == 11;
  if (!in.has(0, 18) || in.u8(1) > 1 || (mapped && in.u8(1) != 1)) return false;
  if (mapped || gray) return depth == 8 || (gray && depth == 16);
  return colour && (depth == 15 || depth == 16 || depth == 24 || depth == 32);
}

Probe probe_webp(const ByteReader& in) {
  Probe probe;
  if (std::uint64_t{in.u32(4)} + 8 > in.size()) probe.damage = kTruncated;
  if (in.starts_with("VP8X", 12)) {
    probe.width = in.u24(24) + 1;
    probe.height = in.u24(27) + 1;
    for (std::size_t at = 30; in.has(at, 8);) {
      const std::size_t length = in.u32(at + 4);
      if (in.starts_with("EXIF", at)) probe.orientation = exif_orientation(in.part(at + 8, length));
      if (!in.has(at + 8, length)) break;
      at += 8 + length + length % 2;
    }
  } else if (in.starts_with("VP8 ", 12)) {
    probe.width = in.u16(26) & 0x3FFF;
    probe.height = in.u16(28) & 0x3FFF;
  } else if (in.starts_with("VP8L", 12)) {
    const std::uint32_t bits = in.u32(21);
    probe.width = (bits & 0x3FFF) + 1;
    probe.height = (bits >> 14 & 0x3FFF) + 1;
  }
  return probe;
}

/// Value of a directory entry of type BYTE, SHORT or LONG with one value.
std::uint32_t tiff_value(const ByteReader& in, std::size_t entry) {
  switch (in.u16(entry + 2)) {
    case 1:
      return in.u8(entry + 8);
    case 3:
      return in.u16(entry + 8);
    case 4:
      return in.u32(entry + 8);
    default:
      return 0;
  }
}

bool is_big_endian(std::span<const std::byte> bytes) {
  return ByteReader(bytes).starts_with("MM\0*"sv);
}

/// The first directory of a classic TIFF file.
Probe probe_tiff(std::span<const std::byte> bytes) {
  const ByteReader in(bytes, is_big_endian(bytes));
  const std::size_t directory = in.u32(4);
  const std::size_t count = in.u16(directory);
  Probe probe;
  if (!in.has(directory, 2 + 12 * count)) {
    probe.damage = kTruncated;
    return probe;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    if (in.u16(entry) == 256) probe.width = tiff_value(in, entry);
    if (in.u16(entry) == 257) probe.height = tiff_value(in, entry);
    if (in.u16(entry) == 274) probe.orientation = tiff_value(in, entry);
  }
  return probe;
}

std::optional<ImageFormat> format_of(const ByteReader& in) {
  if (in.starts_with("\x89PNG\r\n\x1A\n"sv)) return ImageFormat::kPng;
  if (in.starts_with("\xFF\xD8\xFF"sv)) return ImageFormat::kJpeg;
  if (in.starts_with("BM")) return ImageFormat::kBmp;
  if (in.starts_with("RIFF") && in.starts_with("WEBP", 8)) return ImageFormat::kWebp;
  if (in.starts_with("II*\0"sv) || in.starts_with("MM\0*"sv)) return ImageFormat::kTiff;
  if (looks_like_tga(in)) return ImageFormat::kTga;
  return std::nullopt;
}

Probe probe_format(ImageFormat format, std::span<const std::byte> bytes) {
  const ByteReader in(bytes, format == ImageFormat::kPng || format == ImageFormat::kJpeg);
  switch (format) {
    case ImageFormat::kPng:
      return probe_png(in);
    case ImageFormat::kJpeg:
      return probe_jpeg(in);
    case ImageFormat::kBmp:
      return probe_bmp(in);
    case ImageFormat::kTga:
      return {in.u16(12), in.u16(14), 1, {}};
    case ImageFormat::kWebp:
      return probe_webp(in);
    case ImageFormat::kTiff:
      return probe_tiff(bytes);
  }
  return {};
}

}  // namespace

unsigned exif_orientation(std::span<const std::byte> bytes) {
  if (ByteReader(bytes).starts_with("Exif\0\0"sv)) bytes = bytes.subspan(6);
  const ByteReader in(bytes);
  if (!in.starts_with("II*\0"sv) && !in.starts_with("MM\0*"sv)) return 1;
  const unsigned orientation = probe_tiff(bytes).orientation;
  return orientation >= 1 && orientation <= 8 ? orientation : 1;
}

Result<ImageHeader> read_image_header(std::span<const std::byte> bytes, const std::string& name) {
  const std::optional<ImageFormat> format = format_of(ByteReader(bytes));
  if (!format) {
    return fail(ExitCode::kInvalidInput, "image.decode", name,
                "this is no PNG, JPEG, BMP, TGA, WebP or TIFF file",
                "save the image in one of these formats");
  }
  const Probe probe = probe_format(*format, bytes);
  if (probe.width > kMaxImageSide || probe.height > kMaxImageSide) {
    return fail(ExitCode::kInvalidInput, "image.too-large", name,
                "its header states " + std::to_string(probe.width) + "x" +
                    std::to_string(probe.height) + " pixels",
                "scale it to at most " + std::to_string(kMaxImageSide) + " pixels a side");
  }
  std::string_view damage = probe.damage;
  if (damage.empty() && (probe.width == 0 || probe.height == 0)) {
    damage = "its header states no size";
  }
  if (!damage.empty()) {
    return fail(ExitCode::kInvalidInput, "image.decode", name, std::string(damage),
                "export the image again");
  }
  return ImageHeader{*format, probe.width, probe.height, probe.orientation};
}

}  // namespace modar
