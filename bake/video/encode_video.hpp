// Videos made fit for phones: H.264 baseline and AAC in MP4, the index in front, through FFmpeg's
// program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/mp4.hpp"

namespace modar {

/// The greatest sides of a video, pixels.
struct VideoSize {
  std::uint32_t width = 854;
  std::uint32_t height = 480;
};

struct EncodedVideo {
  std::vector<std::byte> bytes;
  Mp4Info info;
};

/// A file that is fit already, as it is; else encoded anew, with its sides and sound, deterministic
/// for one version of FFmpeg. Errors: kIo "io.open"; kUnsupported "video.ffmpeg" where the program
/// or its encoder libx264 is missing; kInvalidInput "video.decode" for what it reads no video from.
Result<EncodedVideo> encode_video(const std::string& path, const VideoSize& most);

/// Whether FFmpeg finds a video there: cheap, before long work. Errors as above.
Result<void> check_video(const std::string& path);

/// Writes the first picture of a video as a PNG file. Errors as above.
Result<void> write_poster(const std::string& path, const std::string& png);

}  // namespace modar
