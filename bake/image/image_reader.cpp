// Image files to 8-bit RGBA through OpenCV, their headers held against limits first.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "bake/image/image.hpp"
#include "bake/image/image_header.hpp"
#include "bake/image/jpeg_check.hpp"
#include "bake/image/tga_reader.hpp"

namespace modar {
namespace {

/// A file of more bytes than this is no image within our limits.
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 31;

Result<std::vector<std::byte>> read_bytes(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  const auto error = [&path] {
    return fail(ExitCode::kIo, "io.open", path, "the image cannot be opened or read",
                "check its name and your rights to read it");
  };
  if (!file) return error();
  std::vector<std::byte> bytes;
  std::vector<std::byte> part(std::size_t{1} << 20);
  while (const std::size_t count = std::fread(part.data(), 1, part.size(), file.get())) {
    bytes.insert(bytes.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(count));
    if (bytes.size() > kMaxFileBytes) {
      return fail(ExitCode::kInvalidInput, "image.too-large", path, "the file is over 2 GiB",
                  "scale the image down");
    }
  }
  if (std::ferror(file.get()) != 0) return error();
  return bytes;
}

std::uint8_t to_byte(std::uint16_t value) {
  return static_cast<std::uint8_t>((std::uint32_t{value} * 255 + 32767) / 65535);
}
std::uint8_t to_byte(std::uint8_t value) {
  return value;
}

/// Gray, BGR or BGRA rows of OpenCV to our pixels.
template <class Sample>
RgbaImage to_rgba(const cv::Mat& mat) {
  RgbaImage image{static_cast<std::uint32_t>(mat.cols), static_cast<std::uint32_t>(mat.rows), {}};
  image.pixels.resize(std::size_t{image.width} * image.height * 4);
  const auto channels = static_cast<std::size_t>(mat.channels());
  std::uint8_t* out = image.pixels.data();
  for (int y = 0; y < mat.rows; ++y) {
    const Sample* in = mat.ptr<Sample>(y);
    for (int x = 0; x < mat.cols; ++x, in += channels, out += 4) {
      out[0] = to_byte(in[channels >= 3 ? 2 : 0]);
      out[1] = to_byte(in[channels >= 3 ? 1 : 0]);
      out[2] = to_byte(in[0]);
      out[3] = channels == 4 ? to_byte(in[3]) : channels == 2 ? to_byte(in[1]) : std::uint8_t{255};
    }
  }
  return image;
}

/// Turns the picture upright; orientation as EXIF counts it.
RgbaImage upright(RgbaImage image, unsigned orientation) {
  if (orientation <= 1 || orientation > 8) return image;
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

/// JPEG has no alpha and OpenCV turns it upright itself; the others keep their channels and depth.
int flags_of(ImageFormat format) {
  return format == ImageFormat::kJpeg ? cv::IMREAD_COLOR : cv::IMREAD_UNCHANGED;
}

/// A PNG without its colour profile: OpenCV uses none, and libpng tells stderr what it thinks of
/// those that it doubts. Bytes after a damaged chunk stay as they are.
std::vector<std::byte> without_profile(std::span<const std::byte> png) {
  constexpr std::size_t kSignature = 8;
  constexpr std::size_t kAround = 12;  // length, type and checksum of a chunk
  std::vector<std::byte> kept;
  kept.reserve(png.size());
  std::size_t first = 0;
  for (std::size_t at = kSignature; at + kAround <= png.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i)
      length = length << 8 | std::to_integer<std::size_t>(png[at + i]);
    if (length > png.size() - at - kAround) break;
    const std::size_t next = at + kAround + length;
    if (std::memcmp(png.data() + at + 4, "iCCP", 4) == 0) {
      kept.insert(kept.end(), png.begin() + static_cast<std::ptrdiff_t>(first),
                  png.begin() + static_cast<std::ptrdiff_t>(at));
      first = next;
    }
    at = next;
  }
  kept.insert(kept.end(), png.begin() + static_cast<std::ptrdiff_t>(first), png.end());
  return kept;
}

cv::Mat decode(std::span<const std::byte> bytes, ImageFormat format) {
  // OpenCV wants a matrix, and leaves these bytes alone.
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1,
                    const_cast<std::byte*>(bytes.data()));
  try {
    return cv::imdecode(raw, flags_of(format));
  } catch (const std::exception&) {
    return {};
  }
}

}  // namespace

Result<RgbaImage> decode_image(std::span<const std::byte> bytes, const std::string& name) {
  const Result<ImageHeader> header = read_image_header(bytes, name);
  if (!header) return tl::unexpected(header.error());
  if (header->format == ImageFormat::kTga) return read_tga(bytes, name);
  if (header->format == ImageFormat::kJpeg) {
    if (const std::string damage = jpeg_damage(bytes); !damage.empty()) {
      return fail(ExitCode::kInvalidInput, "image.decode", name,
                  "the JPEG data is damaged (" + damage + ")", "export the image again");
    }
  }
  const bool png = header->format == ImageFormat::kPng;
  const cv::Mat mat =
      png ? decode(without_profile(bytes), header->format) : decode(bytes, header->format);
  const auto is_side = [&header](int side) {
    const auto value = static_cast<std::uint32_t>(side);
    return value == header->width || value == header->height;
  };
  if (mat.empty() || !is_side(mat.cols) || !is_side(mat.rows)) {
    return fail(ExitCode::kInvalidInput, "image.decode", name, "the image data is damaged",
                "export the image again");
  }
  const bool own = png || header->format == ImageFormat::kWebp;
  const unsigned orientation = own ? header->orientation : 1;
  if (mat.depth() == CV_8U) return upright(to_rgba<std::uint8_t>(mat), orientation);
  if (mat.depth() == CV_16U) return upright(to_rgba<std::uint16_t>(mat), orientation);
  return fail(ExitCode::kInvalidInput, "image.decode", name,
              "its samples are neither 8 nor 16 bits", "save it with 8 bits a channel");
}

Result<RgbaImage> read_image(const std::string& path) {
  const Result<std::vector<std::byte>> bytes = read_bytes(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(*bytes, path);
}

}  // namespace modar
