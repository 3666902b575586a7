// Videos, sounds and captions made fit for phones, through FFmpeg's program: H.264 baseline and AAC
// in MP4, the index in front, and WebVTT.
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

/// A video, or a sound, which has no pictures.
struct EncodedMedia {
  std::vector<std::byte> bytes;
  Mp4Info info;
};

/// A file that is fit already, unchanged; else encoded anew, with its sides and sound,
/// deterministic for one version of FFmpeg. Errors: kIo "io.open"; kUnsupported "video.ffmpeg"
/// where the program or its encoder libx264 is missing; kInvalidInput "video.decode" for what it
/// reads no video from.
Result<EncodedMedia> encode_video(const std::string& path, const VideoSize& most);
/// The same of the first sound track of a file, without its pictures.
Result<EncodedMedia> encode_sound(const std::string& path);

/// Whether FFmpeg finds a video there: cheap, before long work. Errors as above; kInvalidInput
/// "video.still" for one of a single frame.
Result<void> check_video(const std::string& path);
Result<void> check_sound(const std::string& path);

/// Whether a quarter of a video flashes more than three times in a second, as WCAG 2.3.1 counts.
/// Errors as above.
Result<bool> flashes(const std::string& path);

/// A WebVTT file unchanged if it keeps the rules of captions.hpp; else what FFmpeg reads, SubRip
/// for one, as such. Errors: kIo "io.open"; kInvalidInput "captions.read".
Result<std::string> read_captions(const std::string& path);

/// Writes the first picture of a video as a PNG file. Errors as above.
Result<void> write_poster(const std::string& path, const std::string& png);

}  // namespace modar
