// Gray values between pixels. Internal to runtime/track.
#pragma once

#include "modar/image.hpp"

namespace modar::tracker {

/// Bilinear value; the caller keeps 0 <= x < width - 1, 0 <= y < height - 1.
inline float sample(const GrayImage& image, float x, float y) {
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const std::uint8_t* p = image.pixels + row * image.stride + column;
  const float a = p[0];
  const float b = p[1];
  const float c = p[image.stride];
  const float d = p[image.stride + 1];
  const float top = a + fx * (b - a);
  const float bottom = c + fx * (d - c);
  return top + fy * (bottom - top);
}

}  // namespace modar::tracker
