// Pictures and videos through OpenCV's codecs and FFmpeg: 380 MB of Debian packages. They live in a
// library that is loaded when the first is opened, so that a camera and a window need none of it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "frame_sink.hpp"
#include "frame_source.hpp"

namespace modar {

/// What the library does. Errors: those of frame_source.hpp and frame_sink.hpp.
struct Media {
  /// A picture, a video, or a folder of pictures.
  Result<std::unique_ptr<FrameSource>> (*open_path)(const std::string& path);
  /// A camera that sends compressed pictures only. name: what errors call it.
  Result<std::unique_ptr<FrameSource>> (*open_camera)(int number, const std::string& name);
  Result<std::unique_ptr<FrameSink>> (*open_movie)(const std::string& path, double fps);
  /// channels: 3 for R, G, B without gaps, 4 where alpha follows, which is left out.
  Result<std::vector<std::uint8_t>> (*encode_png)(const std::uint8_t* pixels, int width, int height,
                                                  int channels);
};

/// Loaded once, and never unloaded. Errors: kUnsupported "media.library".
Result<const Media*> media();

}  // namespace modar

/// The one function that the library exports.
extern "C" const modar::Media* modar_media();
