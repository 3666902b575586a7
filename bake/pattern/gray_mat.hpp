// Gray pictures as OpenCV's matrices. Internal to bake/pattern.
#pragma once

#include <opencv2/core.hpp>

#include "modar/image.hpp"

namespace modar {

/// Shares the pixels. OpenCV has no constant view: callers must not write through it.
inline cv::Mat as_mat(const GrayImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
          static_cast<std::size_t>(image.stride)};
}

}  // namespace modar
