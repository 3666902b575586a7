#include "bake/video/encode_video.hpp"

#include <string_view>

#include "bake/process/process.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

constexpr double kMostSeconds = 3600;  // longer ones were never meant for a picture

tl::unexpected<Error> unreadable(const std::string& path, const char* what = "video") {
  return fail(ExitCode::kInvalidInput, "video.decode", path,
              std::string("FFmpeg reads no ") + what + " from it",
              "`ffprobe FILE` reports its faults");
}

Result<void> need_ffmpeg() {
  if (run_process({{"ffmpeg", "-loglevel", "quiet", "-version"}, {}, ""}) == 0) return {};
  return fail(ExitCode::kUnsupported, "video.ffmpeg", "ffmpeg", "the program is missing",
              "install FFmpeg (Debian: apt install ffmpeg)");
}

Result<std::vector<std::byte>> read_bytes(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  std::vector<std::byte> bytes(file.bytes().begin(), file.bytes().end());
  MODAR_TRY(file.intact());
  return bytes;
}

bool known_sound(const Mp4Info& info) {
  return info.sound_tracks == 1 && std::string_view(info.sound_codec.data()) == "mp4a";
}

bool lasts(const Mp4Info& info) {
  return info.index_first && info.seconds > 0 && info.seconds <= kMostSeconds;
}

/// A video of these sides at most.
bool fits(const Mp4Info& info, const VideoSize& most) {
  return info.video_tracks == 1 && std::string_view(info.video_codec.data()) == "avc1" &&
         info.profile == kBaselineProfile && (info.sound_tracks == 0 || known_sound(info)) &&
         info.width >= 1 && info.height >= 1 && info.width <= most.width &&
         info.height <= most.height && lasts(info);
}

bool fits_as_sound(const Mp4Info& info) {
  return info.video_tracks == 0 && known_sound(info) && lasts(info);
}

/// Whether FFmpeg decodes something of a file by these words: of a stream and of how much of it.
bool decodes(const std::string& path, const std::vector<std::string>& part) {
  std::vector<std::string> words = {"ffmpeg",    "-loglevel",    "quiet", "-nostdin",
                                    "-abort_on", "empty_output", "-i",    path};
  words.insert(words.end(), part.begin(), part.end());
  words.insert(words.end(), {"-f", "null", "-"});
  return run_process({words, {}, ""}) == 0;
}

Result<void> need_file(const std::string& path) {
  MODAR_TRY(MappedFile::open(path));
  return need_ffmpeg();
}

/// Words of FFmpeg for the pictures.
std::vector<std::string> picture_words(const VideoSize& most) {
  const std::string sides =
      "'min(" + std::to_string(most.width) + ",iw)':'min(" + std::to_string(most.height) + ",ih)'";
  // Even sides, as 4:2:0 needs; one thread, so that the same file gives the same bytes.
  return {"-map",
          "0:v:0",
          "-vf",
          "scale=" + sides +
              ":force_original_aspect_ratio=decrease:force_divisible_by=2:flags=area+"
              "accurate_rnd",
          "-c:v",
          "libx264",
          "-profile:v",
          "baseline",
          "-pix_fmt",
          "yuv420p",
          "-crf",
          "23",
          "-maxrate",
          "2M",
          "-bufsize",
          "2M",
          "-g",
          "60",
          "-threads",
          "1",
          "-flags:v",
          "+bitexact"};
}

/// Of one sound track, where there is one or `sound` asks for it; without dates.
Result<EncodedMedia> run_encoder(const std::string& path, const std::vector<std::string>& pictures,
                                 const char* sound) {
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/out.mp4";
  std::vector<std::string> words = {"ffmpeg", "-loglevel", "error", "-nostdin", "-i", path};
  words.insert(words.end(), pictures.begin(), pictures.end());
  for (const char* word :
       {"-map", sound, "-c:a", "aac", "-b:a", "96k", "-ac", "2", "-map_metadata", "-1", "-fflags",
        "+bitexact", "-flags:a", "+bitexact", "-movflags", "+faststart"}) {
    words.emplace_back(word);
  }
  words.push_back(out);
  if (run_process({words, {}, ""}) != 0) {
    return fail(ExitCode::kUnsupported, "video.ffmpeg", path,
                "FFmpeg could not encode it as H.264 (libx264) and AAC; its messages are above",
                "install an FFmpeg with libx264, as Debian's is");
  }
  EncodedMedia media;
  MODAR_ASSIGN(media.bytes, read_bytes(out));
  view_mp4(media.bytes, media.info);
  return media;
}

tl::unexpected<Error> no_duration(const std::string& path) {
  return fail(ExitCode::kInvalidInput, "video.decode", path,
              "encoded, it has no duration, or one of more than an hour", "shorten it");
}

}  // namespace

Result<void> check_video(const std::string& path) {
  MODAR_TRY(need_file(path));
  if (decodes(path, {"-map", "0:v:0", "-vf", "select=gte(n\\,1)", "-frames:v", "1"})) return {};
  if (!decodes(path, {"-map", "0:v:0", "-frames:v", "1"})) return unreadable(path);
  return fail(ExitCode::kInvalidInput, "video.still", path,
              "it has one frame: a picture, not a video", "show it as a picture");
}

Result<void> check_sound(const std::string& path) {
  MODAR_TRY(need_file(path));
  return decodes(path, {"-map", "0:a:0", "-t", "0.1"}) ? Result<void>() : unreadable(path, "sound");
}

Result<EncodedMedia> encode_video(const std::string& path, const VideoSize& most) {
  EncodedMedia video;
  MODAR_ASSIGN(video.bytes, read_bytes(path));
  if (!view_mp4(video.bytes, video.info) && fits(video.info, most)) return video;
  MODAR_TRY(check_video(path));
  MODAR_ASSIGN(video, run_encoder(path, picture_words(most), "0:a:0?"));
  if (fits(video.info, most)) return video;
  return no_duration(path);
}

Result<EncodedMedia> encode_sound(const std::string& path) {
  EncodedMedia sound;
  MODAR_ASSIGN(sound.bytes, read_bytes(path));
  if (!view_mp4(sound.bytes, sound.info) && fits_as_sound(sound.info)) return sound;
  MODAR_TRY(check_sound(path));
  MODAR_ASSIGN(sound, run_encoder(path, {}, "0:a:0"));
  if (fits_as_sound(sound.info)) return sound;
  return no_duration(path);
}

Result<void> write_poster(const std::string& path, const std::string& png) {
  const int written = run_process({{"ffmpeg", "-loglevel", "error", "-nostdin", "-y", "-i", path,
                                    "-frames:v", "1", "-flags:v", "+bitexact", png},
                                   {},
                                   ""});
  return written == 0 ? Result<void>() : unreadable(path);
}

}  // namespace modar
