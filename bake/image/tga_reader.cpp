// Truevision TGA 2.0 (its "TGA File Format Specification", 1991): pixels, palettes, runs.
#include "bake/image/tga_reader.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "bake/image/byte_reader.hpp"

namespace modar {
namespace {

using Pixel = std::array<std::uint8_t, 4>;

struct TgaHeader {
  bool mapped = false;
  bool gray = false;
  bool runs = false;
  std::uint32_t pixel_bits = 0;
  std::uint32_t map_bits = 0;
  std::uint32_t map_first = 0;
  std::uint32_t map_count = 0;
  std::uint32_t alpha_bits = 0;
  std::size_t map_offset = 0;
  std::size_t data_offset = 0;
};

TgaHeader parse(const ByteReader& in) {
  TgaHeader header;
  const std::uint32_t type = in.u8(2);
  header.mapped = (type & 7) == 1;
  header.gray = (type & 7) == 3;
  header.runs = type >= 9;
  header.map_first = in.u16(3);
  header.map_count = in.u8(1) == 1 ? in.u16(5) : 0;
  header.map_bits = in.u8(7);
  header.pixel_bits = in.u8(16);
  header.alpha_bits = in.u8(17) & 15;
  header.map_offset = 18 + std::size_t{in.u8(0)};
  header.data_offset =
      header.map_offset + std::size_t{header.map_count} * ((header.map_bits + 7) / 8);
  return header;
}

std::uint8_t widen5(std::uint32_t value) {
  return static_cast<std::uint8_t>((value & 31) << 3 | (value & 31) >> 2);
}

/// A colour of 8 (gray), 15, 16, 24 or 32 bits at an offset that has been checked.
Pixel colour_at(const ByteReader& in, std::size_t offset, std::uint32_t bits, bool gray,
                bool has_alpha) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(in.u8(offset + i)); };
  if (gray) return {byte(0), byte(0), byte(0), bits == 16 ? byte(1) : std::uint8_t{255}};
  if (bits == 15 || bits == 16) {
    const std::uint32_t v = in.u16(offset);
    const bool clear = bits == 16 && has_alpha && (v & 0x8000) == 0;
    return {widen5(v >> 10), widen5(v >> 5), widen5(v),
            clear ? std::uint8_t{0} : std::uint8_t{255}};
  }
  return {byte(2), byte(1), byte(0), bits == 32 && has_alpha ? byte(3) : std::uint8_t{255}};
}

/// Reads pixels one after the other, out of runs where the file has them.
class TgaPixels {
 public:
  TgaPixels(const ByteReader& in, const TgaHeader& header)
      : in_(in), header_(header), at_(header.data_offset) {}

  /// Nothing where the file ends or names a colour that its palette has not.
  std::optional<Pixel> next() {
    if (!header_.runs) return read();
    if (left_ == 0) {
      if (!in_.has(at_, 1)) return std::nullopt;
      const std::uint32_t packet = in_.u8(at_++);
      left_ = (packet & 127) + 1;
      repeated_ = packet >= 128;
      if (repeated_) run_ = read();
    }
    --left_;
    return repeated_ ? run_ : read();
  }

 private:
  std::optional<Pixel> read() {
    const std::size_t bytes = (header_.pixel_bits + 7) / 8;
    if (!in_.has(at_, bytes)) return std::nullopt;
    const std::size_t offset = at_;
    at_ += bytes;
    const bool alpha = header_.alpha_bits != 0;
    if (!header_.mapped) return colour_at(in_, offset, header_.pixel_bits, header_.gray, alpha);
    const std::uint32_t index = in_.u8(offset);
    if (index < header_.map_first || index - header_.map_first >= header_.map_count) {
      return std::nullopt;
    }
    const std::size_t entry = std::size_t{index} - header_.map_first;
    return colour_at(in_, header_.map_offset + entry * ((header_.map_bits + 7) / 8),
                     header_.map_bits, false, alpha);
  }

  const ByteReader& in_;
  const TgaHeader& header_;
  std::size_t at_;
  std::uint32_t left_ = 0;
  bool repeated_ = false;
  std::optional<Pixel> run_;
};

/// Refuses, before anything is allocated, what can hold no such image.
bool is_plausible(const ByteReader& in, const TgaHeader& header, std::size_t pixels) {
  const bool map_fits = !header.mapped || header.map_bits == 15 || header.map_bits == 16 ||
                        header.map_bits == 24 || header.map_bits == 32;
  const std::size_t unit = (header.pixel_bits + 7) / 8;
  const std::size_t least = header.runs ? (pixels + 127) / 128 * (1 + unit) : pixels * unit;
  return map_fits && in.has(header.data_offset, least);
}

}  // namespace

Result<RgbaImage> read_tga(std::span<const std::byte> bytes, const std::string& name) {
  const ByteReader in(bytes);
  const TgaHeader header = parse(in);
  RgbaImage image{in.u16(12), in.u16(14), {}};
  const std::size_t count = std::size_t{image.width} * image.height;
  const auto damaged = [&name] {
    return fail(ExitCode::kInvalidInput, "image.decode", name,
                "as a TGA file it is truncated or damaged", "export the image again");
  };
  if (!is_plausible(in, header, count)) return damaged();
  image.pixels.resize(count * 4);
  const bool from_right = (in.u8(17) & 0x10) != 0;
  const bool from_top = (in.u8(17) & 0x20) != 0;
  TgaPixels pixels(in, header);
  for (std::size_t i = 0; i < count; ++i) {
    const std::optional<Pixel> pixel = pixels.next();
    if (!pixel) return damaged();
    std::size_t x = i % image.width;
    std::size_t y = i / image.width;
    if (from_right) x = image.width - 1 - x;
    if (!from_top) y = image.height - 1 - y;
    std::copy(pixel->begin(), pixel->end(),
              image.pixels.begin() + static_cast<std::ptrdiff_t>((y * image.width + x) * 4));
  }
  return image;
}

}  // namespace modar
