// Frames as raw pixels: from Y4M and headerless files and pipes, and from YUV to R, G, B and gray.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
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

/// Fills the frame's size, rgb and gray by ITU-R BT.601, the nearest chroma sample each; grey is Y
/// scaled to the full range. bytes.size() >= frame_bytes(format).
void fill_frame(Frame& frame, const YuvFormat& format, std::span<const std::uint8_t> bytes);

/// Makes the bytes the frame's by swapping them in, where the renderer can draw the layout (NV21,
/// NV12, I420 with even sides): no pixel is converted, and gray is the luma plane itself where it
/// has the full range. Other layouts go through fill_frame().
void take_frame(Frame& frame, const YuvFormat& format, std::vector<std::uint8_t>& bytes);

/// Fills rgb of a frame that has only yuv; nothing where it is there already.
void make_rgb(Frame& frame);

/// Gray from R, G, B by the weights of BT.601: what a recorded frame is replayed with.
void gray_from_rgb(Frame& frame);

/// What an --input names that this source reads.
struct RawInput {
  bool y4m = false;
  YuvFormat format;  ///< of headerless frames; Y4M has it in its header
  double fps = 30;   ///< of headerless frames
  std::string path;  ///< "-": standard input
};

/// True for "-", "FILE.y4m", "y4m:PATH", "nv21:WxH[@FPS]:PATH", and i420, nv12, yuyv, gray alike.
bool is_raw_input(std::string_view input);

/// Errors: kUsage "input.raw" where what follows the colon cannot be read.
Result<RawInput> parse_raw_input(const std::string& input);

/// Y4M's first line: "YUV4MPEG2 W640 H480 F30:1 C420jpeg". Fills format and fps.
/// Errors: kInvalidInput "input.y4m", kUnsupported "input.y4m" (more than 8 bits, alpha).
Result<RawInput> parse_y4m_header(std::string_view line);

/// Opens it; of Y4M reads the header. next() waits for a pipe without spinning and ends when stop()
/// is called. A last frame that is cut short is kInvalidInput "input.truncated".
Result<std::unique_ptr<FrameSource>> open_raw_source(const std::string& input);

}  // namespace modar
