// Which library decodes an image file, and the processing of its pixels afterwards.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <string_view>

#include "bake/image/decoders.hpp"
#include "bake/io/input.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

using std::string_view_literals::operator""sv;

/// A file of more bytes than this is no image within our limits.
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 31;

bool starts_with(std::span<const std::byte> bytes, std::string_view text, std::size_t at = 0) {
  return at <= bytes.size() && text.size() <= bytes.size() - at &&
         std::equal(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    [](char a, std::byte b) { return static_cast<std::byte>(a) == b; });
}

/// Formats of pictures that people have and that are not read, by what their files begin with.
struct ForeignFormat {
  std::string_view start;
  std::size_t at;  ///< byte of the file
  const char* code;
  const char* name;
  const char* conversion;
};
constexpr const char* kHeifConversion =
    "heif-convert IN OUT.jpg (Debian's libheif-examples), or let the phone's camera save JPEG";
constexpr const char* kSvgConversion = "rsvg-convert -w 2000 IN -o OUT.png (Debian's librsvg2-bin)";
constexpr ForeignFormat kForeignFormats[] = {
    {"\xABKTX 20\xBB\r\n\x1A\n"sv, 0, "image.ktx", "KTX 2",
     "ktx extract IN OUT.png (Khronos' KTX-Software); those in a glTF file: npx "
     "@gltf-transform/cli ktxdecompress IN.glb OUT.glb"},
    {"ftypheic", 4, "image.format", "HEIC", kHeifConversion},
    {"ftypheix", 4, "image.format", "HEIC", kHeifConversion},
    {"ftypmif1", 4, "image.format", "HEIF", kHeifConversion},
    {"ftypavif", 4, "image.format", "AVIF", kHeifConversion},
    {"GIF8", 0, "image.format", "GIF", "ffmpeg -i IN -frames:v 1 OUT.png"},
    {"%PDF-", 0, "image.format", "PDF",
     "pdftoppm -singlefile -r 200 -png IN OUT (Debian's poppler-utils)"},
    {"<svg", 0, "image.format", "SVG", kSvgConversion},
    {"<?xml", 0, "image.format", "SVG", kSvgConversion},
    {"DDS ", 0, "image.format", "DDS", "convert IN OUT.png (Debian's imagemagick)"},
    {"8BPS", 0, "image.format", "Photoshop", "ffmpeg -i IN OUT.png"},
};

/// A command for a file, for which IN and OUT are placeholders.
std::string with_names(std::string command, const std::string& name) {
  const std::string stem = std::filesystem::path(name).replace_extension().string();
  for (const auto& [word, by] : {std::pair<std::string, std::string>("IN", name), {"OUT", stem}}) {
    const std::size_t at = command.find(" " + word);
    if (at != std::string::npos) command.replace(at + 1, word.size(), shell_quoted(by));
  }
  return command;
}

/// Bytes of a file in which those that state its colours begin. Camera data come before them.
constexpr std::size_t kMaxProfileAt = 1 << 20;

Result<StoredImage> decode_stored(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  MODAR_TRY(require_kind(FileKind::kPicture, text, name));
  if (starts_with(bytes, "\x89PNG\r\n\x1A\n"sv)) return decode_png(bytes, name);
  if (starts_with(bytes, "\xFF\xD8\xFF"sv)) return decode_jpeg(bytes, name);
  if (starts_with(bytes, "RIFF") && starts_with(bytes, "WEBP", 8)) return decode_webp(bytes, name);
  if (starts_with(bytes, "II*\0"sv) || starts_with(bytes, "MM\0*"sv)) {
    return decode_tiff(bytes, name);
  }
  for (const ForeignFormat& format : kForeignFormats) {
    if (!starts_with(bytes, format.start, format.at)) continue;
    return fail(ExitCode::kUnsupported, format.code, name,
                std::string(format.name) + " files are not read",
                "convert it: " + with_names(format.conversion, name));
  }
  return decode_stb(bytes, name);
}

/// Turns the picture upright.
RgbaImage upright(StoredImage stored) {
  const unsigned orientation = stored.exif.orientation;
  if (orientation <= 1 || orientation > 8) return std::move(stored.image);
  const RgbaImage& image = stored.image;
  const bool swap = orientation >= 5;
  const bool right = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool bottom = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  RgbaImage out{swap ? image.height : image.width, swap ? image.width : image.height, {}};
  out.pixels.resize(image.pixels.size());
  for (std::size_t y = 0; y < out.height; ++y) {
    for (std::size_t x = 0; x < out.width; ++x) {
      std::size_t from_x = swap ? y : x;
      std::size_t from_y = swap ? x : y;
      if (right) from_x = image.width - 1 - from_x;
      if (bottom) from_y = image.height - 1 - from_y;
      const std::uint8_t* from = &image.pixels[(from_y * image.width + from_x) * 4];
      std::copy(from, from + 4, &out.pixels[(y * out.width + x) * 4]);
    }
  }
  return out;
}

/// A number of `count` bytes, of either byte order; 0 beyond the end.
std::uint32_t number_at(std::span<const std::byte> bytes, std::size_t at, std::size_t count,
                        bool big_endian) {
  if (at > bytes.size() || count > bytes.size() - at) return 0;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = at + (big_endian ? i : count - 1 - i);
    value = value << 8 | std::to_integer<std::uint32_t>(bytes[k]);
  }
  return value;
}

/// Reads a directory of an EXIF block, and answers where the exposure's is; 0: not stated.
std::uint32_t read_directory(std::span<const std::byte> exif, std::size_t at, bool big,
                             ExifFacts& facts) {
  constexpr std::size_t kEntryBytes = 12;
  const std::size_t count = number_at(exif, at, 2, big);
  std::uint32_t exposure = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t entry = at + 2 + kEntryBytes * i;
    if (entry + kEntryBytes > exif.size()) break;
    const std::uint32_t type = number_at(exif, entry + 2, 2, big);  // 1: BYTE, 3: SHORT, 4: LONG
    const std::size_t bytes = type == 1 ? 1 : type == 3 ? 2 : type == 4 ? 4 : 0;
    const std::uint32_t value = number_at(exif, entry + 8, bytes, big);
    switch (number_at(exif, entry, 2, big)) {
      case 0x0112:
        facts.orientation = value;
        break;
      case 0x8769:
        exposure = value;
        break;
      case 0xA002:
        facts.width = value;
        break;
      case 0xA003:
        facts.height = value;
        break;
      case 0xA405:
        facts.focal_35mm = value;
        break;
      default:
        break;
    }
  }
  return exposure;
}

/// The focal length in pixels of a picture that is as its camera took it, or reduced from that; 0:
/// not known, or cropped since.
double focal_px(const StoredImage& stored) {
  constexpr double kFilmDiagonal = 43.266615;  // mm, of 36 x 24
  constexpr double kSameShape = 0.01;
  const ExifFacts& exif = stored.exif;
  const double width = stored.image.width;
  const double height = stored.image.height;
  if (exif.focal_35mm == 0 || exif.width == 0 || exif.height == 0) return 0;
  const double shape = width * exif.height / (height * exif.width);
  if (std::fabs(shape - 1) > kSameShape) return 0;
  return exif.focal_35mm / kFilmDiagonal * std::hypot(width, height);
}

bool ends_as(const std::string& path, std::initializer_list<std::string_view> endings) {
  const std::string ending = ascii_lower(std::filesystem::path(path).extension().string());
  return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

}  // namespace

Result<void> check_image_size(std::uint64_t width, std::uint64_t height, std::size_t file_bytes,
                              const std::string& name) {
  const std::uint64_t most = std::max(kMaxImagePixels, kMaxPixelsPerByte * file_bytes);
  if (width > kMaxImageSide || height > kMaxImageSide || width * height > most) {
    return fail(
        ExitCode::kInvalidInput, "image.too-large", name,
        with_numbers("its header states {}x{} pixels", {width, height}),
        with_numbers("scale it to at most {} pixels a side and {} in all, such as 8192x8192",
                     {kMaxImageSide, kMaxImagePixels}));
  }
  if (width == 0 || height == 0) return damaged_image(name, "its header states no size");
  return {};
}

ExifFacts exif_facts(std::span<const std::byte> exif) {
  if (starts_with(exif, "Exif\0\0"sv)) exif = exif.subspan(6);
  const bool big = starts_with(exif, "MM\0*"sv);
  ExifFacts facts;
  if (!big && !starts_with(exif, "II*\0"sv)) return facts;
  const std::uint32_t exposure = read_directory(exif, number_at(exif, 4, 4, big), big, facts);
  if (exposure != 0) read_directory(exif, exposure, big, facts);
  if (facts.orientation < 1 || facts.orientation > 8) facts.orientation = 1;
  return facts;
}

bool is_opaque(const RgbaImage& image) {
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
    if (image.pixels[i] != 255) return false;
  }
  return true;
}

bool is_picture_file(const std::string& path) {
  return ends_as(path, {".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".bmp", ".tga"});
}

bool is_foreign_picture_file(const std::string& path) {
  return ends_as(path, {".heic", ".heif", ".avif", ".gif", ".pdf", ".svg", ".psd"});
}

Result<RgbaImage> decode_image(std::span<const std::byte> bytes, const std::string& name,
                               Colours colours) {
  MODAR_ASSIGN(StoredImage stored, decode_stored(bytes, name));
  if (colours == Colours::kSrgb) convert_to_srgb(stored.colours, stored.image);
  return upright(std::move(stored));
}

Result<RgbaImage> read_image(const std::string& path, Colours colours) {
  MODAR_ASSIGN(const std::string file, read_file(path, kMaxFileBytes));
  return decode_image(std::as_bytes(std::span(file)), path, colours);
}

Result<RgbaImage> read_texture(const std::string& path, Colours colours) {
  MODAR_ASSIGN(const std::string file, read_file(path, kMaxFileBytes));
  MODAR_ASSIGN(StoredImage stored, decode_stored(std::as_bytes(std::span(file)), path));
  if (colours == Colours::kSrgb) convert_to_srgb(stored.colours, stored.image);
  return std::move(stored.image);
}

bool states_other_colours(const std::string& path) {
  const auto file = read_file(path, kMaxFileBytes);
  constexpr std::array kSigns = {"iCCP"sv, "gAMA"sv, "cHRM"sv, "ICC_PROFILE"sv, "ICCP"sv};
  const auto is_there = [&](std::string_view sign) { return file->find(sign) < kMaxProfileAt; };
  if (!file || ranges::none_of(kSigns, is_there)) return false;
  auto stored = decode_stored(std::as_bytes(std::span(*file)), path);
  return stored && convert_to_srgb(stored->colours, stored->image);
}

Result<Photo> read_photo(const std::string& path) {
  MODAR_ASSIGN(const std::string file, read_file(path, kMaxFileBytes));
  MODAR_ASSIGN(StoredImage stored, decode_stored(std::as_bytes(std::span(file)), path));
  convert_to_srgb(stored.colours, stored.image);
  const double focal = focal_px(stored);
  return Photo{upright(std::move(stored)), focal};
}

Result<LinearImage> decode_linear_image(std::span<const std::byte> bytes, const std::string& name) {
  if (is_radiance(bytes)) return decode_radiance(bytes, name);
  MODAR_ASSIGN(const RgbaImage image, decode_image(bytes, name));
  return to_linear(image);
}

Result<LinearImage> read_linear_image(const std::string& path) {
  MODAR_ASSIGN(const std::string file, read_file(path, kMaxFileBytes));
  return decode_linear_image(std::as_bytes(std::span(file)), path);
}

}  // namespace modar
