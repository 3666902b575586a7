// Where frames come from: a video file, a picture, a folder of pictures, a camera.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "modar/image.hpp"
#include "modar/renderer.hpp"

namespace modar {

/// One frame. Its buffers are used again: next() overwrites them.
struct Frame {
  std::uint64_t index = 0;      ///< in the source, from 0
  double time_s = 0;            ///< since the first frame; of a file: index / rate
  double read_ms = 0;           ///< that reading it took
  std::int64_t arrived_ns = 0;  ///< steady clock when it was complete
  bool new_scene = false;       ///< of stills: it does not continue the frame before
  int width = 0;
  int height = 0;
  double reduced = 1;                          ///< a pixel's side, in pixels of the file
  PictureFormat format = PictureFormat::kRgb;  ///< kRgb: the picture is in rgb, else in yuv
  bool full_range = true;                      ///< of yuv: luma from 0 to 255
  std::vector<std::uint8_t> yuv;   ///< planes as the camera gave them, sides even; the GPU converts
  std::vector<std::uint8_t> rgb;   ///< 3 * width * height, top row first; see make_rgb()
  std::vector<std::uint8_t> gray;  ///< width * height; empty where the first plane of yuv is it

  [[nodiscard]] RgbImage rgb_image() const {
    return {rgb.data(), width, height, std::ptrdiff_t{3} * width};
  }
  [[nodiscard]] GrayImage gray_image() const {
    return {gray.empty() ? yuv.data() : gray.data(), width, height, width};
  }
  /// The picture behind the models.
  [[nodiscard]] CameraPicture picture() const;
};

struct SourceInfo {
  double fps = 30;           ///< frames a second; 30 where the source does not say
  std::uint64_t frames = 0;  ///< 0: unknown
  bool live = false;         ///< frames come whether we are ready or not
  bool stills = false;       ///< pictures, which may have nothing to do with each other
};

class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  [[nodiscard]] virtual SourceInfo info() const = 0;
  /// Reads the next frame into `frame`. Answers false at the end. Errors: kInvalidInput
  /// "input.damaged", kIo "input.read".
  virtual Result<bool> next(Frame& frame) = 0;
  /// Called from another thread: a next() that waits, and each later one, answers false.
  virtual void stop() = 0;
  /// Pictures that next() has left out since they cannot be read. Not while next() runs.
  [[nodiscard]] virtual std::span<const Error> skipped() const { return {}; }
};

/// input: a path, "camera" or "camera:N", or raw frames (see raw_source.hpp). Errors: kIo
/// "input.open", kInvalidInput "input.*", kUnsupported "input.unsupported" in a build that cannot
/// read it.
Result<std::unique_ptr<FrameSource>> open_frame_source(const std::string& input);

}  // namespace modar
