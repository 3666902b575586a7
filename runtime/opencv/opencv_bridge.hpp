// Between our records and OpenCV's types. Internal to runtime/extensions/paper.
#pragma once

#include <utility>

#include <opencv2/core.hpp>

#include "formats/base/error.hpp"
#include "formats/layout.hpp"
#include "modar/image.hpp"

namespace modar::paper {

inline cv::Mat view_of(const GrayImage& image) {
  // OpenCV has no constant view; nothing below writes through it.
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.pixels),
          static_cast<std::size_t>(image.stride)};
}

inline cv::KeyPoint to_opencv(const KeypointRecord& record) {
  return {record.x,        record.y,      record.size,    record.angle,
          record.response, record.octave, record.class_id};
}

inline KeypointRecord from_opencv(const cv::KeyPoint& point) {
  return {point.pt.x,     point.pt.y,   point.size,    point.angle,
          point.response, point.octave, point.class_id};
}

/// Runs `work`, which answers a Result, and turns what OpenCV throws into an error of `code`.
template <class Work>
auto guarded(ExitCode exit, const char* code, const char* cure, Work&& work) -> decltype(work()) {
  try {
    return std::forward<Work>(work)();
  } catch (const std::exception& thrown) {
    return fail(exit, code, "", thrown.what(), cure);
  }
}

}  // namespace modar::paper
