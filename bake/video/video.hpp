// Video files on the workstation. OpenCV's reader of videos maps 200 libraries, so it is in a
// library of its own that is loaded when the first video is opened: `modar --version` maps few.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "formats/base/error.hpp"
#include "modar/image.hpp"

namespace modar {

/// Frames of a video, in order.
class Video {
 public:
  /// A file that is no video has no frame. Errors: kIo "video.library" where the library that reads
  /// videos cannot be loaded.
  static Result<Video> open(const std::string& path);

  /// The next frame, gray, valid until the next call; nothing after the last one.
  std::optional<GrayImage> next();
  /// As the file states it; 0: unknown.
  [[nodiscard]] std::uint64_t frames() const { return frames_; }

 private:
  std::shared_ptr<void> reader_;  ///< empty: no video
  std::uint64_t frames_ = 0;
};

}  // namespace modar
