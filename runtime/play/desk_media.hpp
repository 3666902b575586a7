// Pictures and videos through OpenCV's codecs and FFmpeg: 380 MB of Debian packages. They live in a
// library that is loaded when the first is opened, so that a camera and a window need none of it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "frame_sink.hpp"
#include "frame_source.hpp"
#include "modar/image.hpp"

namespace modar {

/// The pictures of a video in memory, which outlives it.
class ClipReader {
 public:
  ClipReader() = default;
  ClipReader(const ClipReader&) = delete;
  ClipReader& operator=(const ClipReader&) = delete;
  virtual ~ClipReader() = default;

  /// To the last picture that begins at that time or before, seconds; behind the end, the last one.
  /// Answers whether it is another than before. Going back decodes from the beginning. Errors:
  /// kInvalidInput "input.damaged".
  virtual Result<bool> seek(double seconds) = 0;
  /// That picture, valid until the next seek().
  [[nodiscard]] virtual RgbImage picture() const = 0;
};

/// The sound of a file in memory, which outlives it.
class SoundReader {
 public:
  SoundReader() = default;
  SoundReader(const SoundReader&) = delete;
  SoundReader& operator=(const SoundReader&) = delete;
  virtual ~SoundReader() = default;

  [[nodiscard]] virtual int rate() const = 0;  ///< of each channel, a second
  /// Appends some samples, left and right in turn, -1 to 1. False at the end, or where the rest is
  /// damaged.
  virtual bool read(std::vector<float>& samples) = 0;
  /// To a time from the beginning, seconds, exact to a sample.
  virtual void seek(double seconds) = 0;
};

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
  /// name: what errors call it. Errors: kInvalidInput "input.damaged", kIo "input.open".
  Result<std::unique_ptr<ClipReader>> (*open_clip)(std::span<const std::byte> file,
                                                   const std::string& name);
  /// Errors: the same; kUnsupported "sound.unsupported" where FFmpeg's libraries were not there
  /// when this was built.
  Result<std::unique_ptr<SoundReader>> (*open_sound)(std::span<const std::byte> file,
                                                     const std::string& name);
};

/// Loaded once, and never unloaded. Errors: kUnsupported "media.library".
Result<const Media*> media();

}  // namespace modar

/// The one function that the library exports.
extern "C" const modar::Media* modar_play_media();
