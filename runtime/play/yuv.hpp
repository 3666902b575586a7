// From the pixels of cameras and raw video to R, G, B and gray.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "frame_source.hpp"

namespace modar {

enum class YuvLayout : std::uint8_t {
  kI420,  ///< planes Y, U, V; chroma halved both ways
  kNv12,  ///< plane Y, then U and V in turn; halved both ways
  kNv21,  ///< plane Y, then V and U in turn; halved both ways (Android's camera)
  kI422,  ///< planes Y, U, V; chroma halved across
  kYuyv,  ///< Y0 U Y1 V in turn (most USB cameras)
  kI444,  ///< planes Y, U, V
  kGray,  ///< plane Y
};

struct YuvFormat {
  YuvLayout layout = YuvLayout::kI420;
  int width = 0;
  int height = 0;
  bool full_range = false;  ///< Y from 0 to 255 (JPEG, Android), else 16 to 235 (video)
};

/// Bytes of a frame without gaps; an odd side has one chroma sample more than its half.
std::size_t frame_bytes(const YuvFormat& format);

/// Fills the frame's size, rgb and gray by ITU-R BT.601, the nearest chroma sample each; gray is Y
/// brought to the full range. bytes.size() >= frame_bytes(format).
void fill_frame(Frame& frame, const YuvFormat& format, std::span<const std::uint8_t> bytes);

/// Makes the bytes the frame's by swapping them in, where the renderer can draw the layout (NV21,
/// NV12, I420 with even sides): no pixel is converted, and gray is the luma plane itself where it
/// has the full range. Other layouts go through fill_frame().
void take_frame(Frame& frame, const YuvFormat& format, std::vector<std::uint8_t>& bytes);

/// Fills rgb of a frame that has only yuv; nothing where it is there already.
void make_rgb(Frame& frame);

/// Gray from R, G, B by the weights of BT.601: what a recorded frame is replayed with.
void gray_from_rgb(Frame& frame);

}  // namespace modar
