// Video files, and cameras that need decoding, through OpenCV and FFmpeg. For desks only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "formats/base/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Blue, green and red bytes, row by row, owned by a VideoReader.
struct BgrPicture {
  const std::uint8_t* pixels = nullptr;
  int width = 0;
  int height = 0;
  std::size_t stride = 0;  ///< bytes
};

class VideoReader {
 public:
  /// Errors: kInvalidInput "input.damaged" where the file is not a video.
  static Result<VideoReader> open_file(const std::string& path);
  /// The Video4Linux2 device of that number. name: what errors call it. Errors: kIo "input.open".
  static Result<VideoReader> open_camera(int number, const std::string& name);
  VideoReader(VideoReader&&) noexcept;
  ~VideoReader();

  /// Frames per second; 30 if the video does not state it.
  [[nodiscard]] double fps() const;
  /// Frames of the file as its header states them; 0: unknown, or a camera.
  [[nodiscard]] std::uint64_t frames() const;
  /// Decodes the next frame. False at the end. Errors: kInvalidInput "input.damaged" where not even
  /// one frame can be decoded, or a camera stops.
  Result<bool> next();
  /// When the frame is shown, seconds from the first one's time on a file's own clock.
  [[nodiscard]] double time_s() const;
  /// The frame, valid until the following next().
  [[nodiscard]] BgrPicture picture() const;
  /// The same frame in gray.
  [[nodiscard]] GrayImage gray();

 private:
  struct State;
  explicit VideoReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Stops OpenCV and FFmpeg from writing to stderr: their errors come back as Error. Readers do so
/// when they are opened.
void silence_opencv();

}  // namespace modar
