// Views of pixels, which the caller owns, and a picture that owns its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace modar {

/// 8-bit gray pixels, top row first. stride: bytes from row to row, >= width.
struct GrayImage {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;
};

/// A gray picture that owns its pixels, row by row without padding.
struct GrayPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
  [[nodiscard]] GrayImage view() const { return {pixels.data(), width, height, width}; }
};

/// 8-bit R, G, B pixels, top row first. stride: bytes from row to row, >= 3 * width.
struct RgbImage {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;
};

}  // namespace modar
