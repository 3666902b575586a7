// Reads pattern pictures with bake/image, converts them to gray and limits their size.
#include "bake/pattern/picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>

#include <opencv2/imgproc.hpp>

#include "bake/pattern/target_file.hpp"
#include "formats/base/colour.hpp"
#include "formats/colour_grid.hpp"

namespace modar {
namespace {

// Pixels of a side. A larger picture only moves features to scales at which a 1280x720 camera does
// not see them.
constexpr int kLargestPattern = 720;

/// Cells across and down: fine enough to see a shadow that falls on a part of a pattern, coarse
/// enough that a few samples tell a cell's mean.
constexpr std::uint32_t kColourCells = 8;

}  // namespace

GrayPicture gray_of(const RgbaImage& image) {
  GrayPicture gray;
  gray.width = static_cast<int>(image.width);
  gray.height = static_cast<int>(image.height);
  gray.pixels.reserve(image.pixels.size() / 4);
  for (std::size_t i = 0; i + 3 < image.pixels.size(); i += 4) {
    const std::uint8_t* p = image.pixels.data() + i;
    // In 16-bit fixed point: the same bytes on every machine.
    const std::uint32_t luma = (19595u * p[0] + 38470u * p[1] + 7471u * p[2] + 32768u) >> 16;
    gray.pixels.push_back(
        static_cast<std::uint8_t>((luma * p[3] + 255u * (255u - p[3]) + 127u) / 255u));
  }
  return gray;
}

Result<GrayPicture> load_gray(const std::string& path) {
  MODAR_ASSIGN(const RgbaImage image, read_image(path));
  return gray_of(image);
}

std::array<int, 2> pattern_sides(int width, int height) {
  const double scale = std::min(1.0, 1.0 * kLargestPattern / std::max(width, height));
  const auto scaled = [&](int side) {
    return std::max(1, static_cast<int>(std::lround(side * scale)));
  };
  return {scaled(width), scaled(height)};
}

Result<GrayPicture> load_pattern(const std::string& path, bool& shrunk) {
  if (path.ends_with(".mind")) {
    return fail(ExitCode::kUnsupported, "pattern.mind", path,
                "a compiled MindAR file contains only small copies of its pictures",
                "pass the pictures that it was compiled from, in the same order");
  }
  MODAR_ASSIGN(GrayPicture gray, is_target_file(path) ? load_target(path) : load_gray(path));
  const auto [width, height] = pattern_sides(gray.width, gray.height);
  shrunk = width < gray.width || height < gray.height;
  if (!shrunk) return gray;
  try {
    const cv::Mat large(gray.height, gray.width, CV_8UC1, gray.pixels.data());
    GrayPicture out;
    out.width = width;
    out.height = height;
    out.pixels.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
    cv::Mat small(out.height, out.width, CV_8UC1, out.pixels.data());
    cv::resize(large, small, small.size(), 0, 0, cv::INTER_AREA);
    return out;
  } catch (const std::exception& thrown) {
    return fail(ExitCode::kInternal, "pattern.opencv", path, thrown.what(), "report this as a bug");
  }
}

std::vector<std::byte> pattern_colours(const RgbaImage& image) {
  // Sums of rows first: each pixel is read once.
  std::array<std::array<double, 4>, kColourCells * kColourCells> sums{};
  std::array<double, 256> linear{};
  for (std::size_t i = 0; i < linear.size(); ++i) {
    linear[i] = linear_of_srgb(static_cast<double>(i) / 255);
  }
  for (std::size_t i = 0; i + 3 < image.pixels.size(); i += 4) {
    const std::size_t x = i / 4 % image.width;
    const std::size_t y = i / 4 / image.width;
    auto& sum =
        sums[y * kColourCells / image.height * kColourCells + x * kColourCells / image.width];
    const double alpha = image.pixels[i + 3] / 255.0;
    for (std::size_t c = 0; c < 3; ++c) {
      sum[c] += alpha * linear[image.pixels[i + c]] + (1 - alpha);
    }
    sum[3] += 1;
  }
  const ColourGridHeader header{kColourCells, kColourCells, {}};
  std::vector<std::byte> section(sizeof header + 6 * sums.size());
  std::memcpy(section.data(), &header, sizeof header);
  for (std::size_t cell = 0; cell < sums.size(); ++cell) {
    for (std::size_t c = 0; c < 3; ++c) {
      // A picture of fewer pixels than cells leaves some empty: white.
      const double mean = sums[cell][3] > 0 ? sums[cell][c] / sums[cell][3] : 1.0;
      const auto code = static_cast<std::uint16_t>(std::lround(65535 * mean));
      std::memcpy(section.data() + sizeof header + 6 * cell + 2 * c, &code, sizeof code);
    }
  }
  return section;
}

Result<std::vector<std::string>> pictures_of(const std::string& path) {
  namespace fs = std::filesystem;
  std::vector<std::string> paths;
  std::error_code failed;
  if (fs::is_regular_file(path, failed)) return std::vector<std::string>{path};
  for (const auto& entry : fs::directory_iterator(path, failed)) {
    std::string ending = entry.path().extension().string();
    for (char& letter : ending) {
      if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
    }
    if (ending == ".png" || ending == ".jpg" || ending == ".jpeg") {
      paths.push_back(entry.path().string());
    }
  }
  if (failed || paths.empty()) {
    return fail(ExitCode::kIo, "pictures.folder", path, "no pictures can be read here",
                "name a folder with PNG or JPEG files, or one such file");
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

Result<void> open_folders(std::vector<std::string>& paths) {
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    std::error_code failed;
    if (!std::filesystem::is_directory(path, failed)) {
      files.push_back(path);
      continue;
    }
    MODAR_ASSIGN(const auto pictures, pictures_of(path));
    files.insert(files.end(), pictures.begin(), pictures.end());
  }
  paths = std::move(files);
  return {};
}

}  // namespace modar
