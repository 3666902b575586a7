// Raw frames from a file or a pipe: Y4M, and headerless NV21 and its kin.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "frame_source.hpp"
#include "yuv.hpp"

namespace modar {

/// What an --input names that this source reads.
struct RawInput {
  bool y4m = false;
  YuvFormat format;  ///< of headerless frames; of Y4M its header tells
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
