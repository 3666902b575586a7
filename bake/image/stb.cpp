// BMP, Truevision TGA and Radiance HDR files through stb_image, which fills what a truncated file
// lacks with anything: reads beyond the end are noted, and refused.
#include <cmath>
#include <memory>
#include <string_view>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_BMP
#define STBI_ONLY_HDR
#define STBI_ONLY_TGA
#define STBI_NO_STDIO
#include <stb/stb_image.h>

#include "bake/image/decoders.hpp"

namespace modar {
namespace {

struct StbFile {
  MemoryFile in;
  /// Where stb_image keeps what it has read ahead: there, and only there, it takes fewer bytes than
  /// it asks for.
  const char* read_ahead = nullptr;
  bool beyond_end = false;
};

StbFile& file_of(void* user) {
  return *static_cast<StbFile*>(user);
}

int on_read(void* user, char* to, int size) {
  StbFile& file = file_of(user);
  if (file.read_ahead == nullptr) file.read_ahead = to;
  const std::size_t asked = static_cast<std::size_t>(size);
  const std::size_t got = file.in.read(to, asked);
  file.beyond_end = file.beyond_end || got == 0 || (got < asked && to != file.read_ahead);
  return static_cast<int>(got);
}
void on_skip(void* user, int count) {
  StbFile& file = file_of(user);
  const std::size_t left = file.in.bytes.size() - file.in.at;
  file.beyond_end = file.beyond_end || static_cast<std::size_t>(count) > left;
  file.in.at += std::min(static_cast<std::size_t>(count), left);
}
int on_end(void* user) {
  return file_of(user).in.at == file_of(user).in.bytes.size() ? 1 : 0;
}

constexpr stbi_io_callbacks kCallbacks = {on_read, on_skip, on_end};

/// What stb_image passes over in a TGA file's header of 18 bytes.
struct TgaQuirks {
  bool from_right = false;   ///< rows are stored from right to left
  bool no_alpha = false;     ///< the fourth byte of 32-bit pixels means nothing
  bool shifted_map = false;  ///< the colour map does not begin with entry 0
};

TgaQuirks tga_quirks(std::span<const std::byte> bytes) {
  const auto at = [&](std::size_t i) { return std::to_integer<unsigned>(bytes[i]); };
  const bool gray = (at(2) & 7) == 3;
  return {(at(17) & 0x10) != 0, !gray && (at(17) & 15) == 0, at(1) == 1 && (at(3) | at(4)) != 0};
}

/// Pixels of the longest run that a packet of two bytes can hold.
constexpr std::size_t kLongestRun = 128;

/// Whether the rows of a Radiance file with runs are all there: stb_image waits for ever for what
/// lacks. Rows without runs are left to it.
bool whole_runs(std::span<const std::byte> bytes, std::size_t width, std::size_t height) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t header = text.find("\n\n");
  if (header == std::string_view::npos) return false;
  const std::size_t size_line = text.find('\n', header + 2);
  if (size_line == std::string_view::npos) return false;
  std::size_t at = size_line + 1;
  const auto byte = [&](std::size_t i) {
    return i < bytes.size() ? std::to_integer<std::size_t>(bytes[i]) : 0;
  };
  for (std::size_t row = 0; row < height; ++row) {
    const bool runs = byte(at) == 2 && byte(at + 1) == 2 && byte(at + 2) < 128;
    if (!runs) return row == 0;
    at += 4;
    for (std::size_t left = 4 * width; left > 0;) {
      const std::size_t code = byte(at);
      const std::size_t count = code > 128 ? code - 128 : code;
      if (count == 0 || count > (left - 1) % width + 1) return false;
      left -= count;
      at += code > 128 ? 2 : 1 + count;
    }
    if (at > bytes.size()) return false;
  }
  return true;
}

}  // namespace

Result<LinearImage> decode_radiance(std::span<const std::byte> bytes, const std::string& name) {
  StbFile header{{bytes}};
  int width = 0;
  int height = 0;
  int channels = 0;
  if (stbi_info_from_callbacks(&kCallbacks, &header, &width, &height, &channels) == 0) {
    return damaged_image(name, "its header is not that of a supported Radiance file");
  }
  const auto columns = static_cast<std::uint64_t>(std::max(width, 0));
  const auto rows = static_cast<std::uint64_t>(std::max(height, 0));
  MODAR_TRY(check_image_size(columns, rows, bytes.size(), name));
  const auto truncated = [&] { return damaged_image(name, "the file ends before its image does"); };
  if (columns * rows > bytes.size() * kLongestRun) return truncated();  // before it is allocated
  const bool with_runs = columns >= 8 && columns < 32768;
  if (with_runs && !whole_runs(bytes, columns, rows)) return truncated();
  StbFile file{{bytes}};
  const std::unique_ptr<float, void (*)(void*)> pixels(
      stbi_loadf_from_callbacks(&kCallbacks, &file, &width, &height, &channels, 4),
      &stbi_image_free);
  if (file.beyond_end) return truncated();
  if (!pixels) return damaged_image(name, "the Radiance data is damaged or of an unknown kind");
  LinearImage image;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.pixels.assign(pixels.get(), pixels.get() + 4 * columns * rows);
  return image;
}

Result<StoredImage> decode_stb(std::span<const std::byte> bytes, const std::string& name) {
  constexpr std::size_t kTgaHeader = 18;
  StbFile header{{bytes}};
  int width = 0;
  int height = 0;
  int channels = 0;
  if (bytes.size() < kTgaHeader || is_radiance(bytes) ||
      stbi_info_from_callbacks(&kCallbacks, &header, &width, &height, &channels) == 0) {
    return fail(ExitCode::kInvalidInput, "image.decode", name,
                "this is not a readable PNG, JPEG, BMP, TGA, WebP or TIFF file",
                "save the image in one of these formats");
  }
  const auto columns = static_cast<std::uint64_t>(std::abs(std::int64_t{width}));
  const auto rows = static_cast<std::uint64_t>(std::abs(std::int64_t{height}));
  MODAR_TRY(check_image_size(columns, rows, bytes.size(), name));
  const bool bmp = bytes[0] == std::byte{'B'} && bytes[1] == std::byte{'M'};
  const TgaQuirks quirks = bmp ? TgaQuirks{} : tga_quirks(bytes);
  if (quirks.shifted_map) {
    return damaged_image(name, "its colour map does not begin with entry 0");
  }
  const auto truncated = [&] { return damaged_image(name, "the file ends before its image does"); };
  if (columns * rows > bytes.size() * kLongestRun) return truncated();  // before it is allocated
  StbFile file{{bytes}};
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load_from_callbacks(&kCallbacks, &file, &width, &height, &channels, 4),
      &stbi_image_free);
  if (file.beyond_end) return truncated();
  if (!pixels) {
    return damaged_image(
        name, std::string(bmp ? "the BMP" : "the TGA") + " data is damaged or of an unknown kind");
  }
  StoredImage stored;
  allocate_pixels(stored.image, static_cast<std::uint32_t>(width),
                  static_cast<std::uint32_t>(height));
  std::copy_n(pixels.get(), stored.image.pixels.size(), stored.image.pixels.data());
  if (quirks.no_alpha) {
    for (std::size_t i = 3; i < stored.image.pixels.size(); i += 4) stored.image.pixels[i] = 255;
  }
  if (quirks.from_right) stored.exif.orientation = 2;
  return stored;
}

}  // namespace modar
