// Images to PNG files.
#include <exception>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "bake/image/image.hpp"
#include "formats/atomic_file.hpp"

namespace modar {
namespace {

/// A PNG's bytes; empty where OpenCV fails.
std::vector<unsigned char> encode_png(const RgbaImage& image) {
  std::vector<unsigned char> bytes;
  try {
    cv::Mat bgra(static_cast<int>(image.height), static_cast<int>(image.width), CV_8UC4);
    for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
      bgra.data[i] = image.pixels[i + 2];
      bgra.data[i + 1] = image.pixels[i + 1];
      bgra.data[i + 2] = image.pixels[i];
      bgra.data[i + 3] = image.pixels[i + 3];
    }
    if (!cv::imencode(".png", bgra, bytes)) bytes.clear();
  } catch (const std::exception&) {
    bytes.clear();
  }
  return bytes;
}

}  // namespace

Result<void> write_png(const RgbaImage& image, const std::string& path) {
  const std::vector<unsigned char> bytes = encode_png(image);
  if (bytes.empty()) {
    return fail(ExitCode::kInternal, "image.encode", path, "the image cannot be encoded as PNG",
                "try a smaller one");
  }
  return write_file(path, std::as_bytes(std::span(bytes)));
}

}  // namespace modar
