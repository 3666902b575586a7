#include "bake/video/encode_video.hpp"

#include <string_view>

#include "bake/process.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

constexpr double kMostSeconds = 3600;  // longer ones were never meant to stand on a picture

tl::unexpected<Error> unreadable(const std::string& path) {
  return fail(ExitCode::kInvalidInput, "video.decode", path, "FFmpeg reads no video from it",
              "`ffprobe FILE` says what is wrong with it");
}

Result<void> need_ffmpeg() {
  if (run_process({{"ffmpeg", "-loglevel", "quiet", "-version"}, {}, ""}) == 0) return {};
  return fail(ExitCode::kUnsupported, "video.ffmpeg", "ffmpeg", "the program is missing",
              "install FFmpeg (Debian: apt install ffmpeg)");
}

Result<std::vector<std::byte>> read_bytes(const std::string& path) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  return std::vector<std::byte>(file.bytes().begin(), file.bytes().end());
}

bool fits(const Mp4Info& info, const VideoSize& most) {
  const bool sound =
      info.sound_tracks == 0 ||
      (info.sound_tracks == 1 && std::string_view(info.sound_codec.data()) == "mp4a");
  return info.video_tracks == 1 && std::string_view(info.video_codec.data()) == "avc1" &&
         info.profile == kBaselineProfile && info.index_first && sound && info.width >= 1 &&
         info.height >= 1 && info.width <= most.width && info.height <= most.height &&
         info.seconds > 0 && info.seconds <= kMostSeconds;
}

}  // namespace

Result<void> check_video(const std::string& path) {
  MODAR_TRY(MappedFile::open(path));
  MODAR_TRY(need_ffmpeg());
  const int read = run_process({{"ffmpeg", "-loglevel", "quiet", "-nostdin", "-i", path, "-map",
                                 "0:v:0", "-frames:v", "1", "-f", "null", "-"},
                                {},
                                ""});
  return read == 0 ? Result<void>() : unreadable(path);
}

Result<EncodedVideo> encode_video(const std::string& path, const VideoSize& most) {
  EncodedVideo video;
  MODAR_ASSIGN(video.bytes, read_bytes(path));
  if (!view_mp4(video.bytes, video.info) && fits(video.info, most)) return video;
  MODAR_TRY(check_video(path));
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/out.mp4";
  const std::string sides =
      "'min(" + std::to_string(most.width) + ",iw)':'min(" + std::to_string(most.height) + ",ih)'";
  // Even sides, as 4:2:0 needs; one thread and no date, so that the same file gives the same bytes.
  const ProcessRequest encode = {
      {"ffmpeg",
       "-loglevel",
       "error",
       "-nostdin",
       "-i",
       path,
       "-map",
       "0:v:0",
       "-map",
       "0:a:0?",
       "-vf",
       "scale=" + sides +
           ":force_original_aspect_ratio=decrease:force_divisible_by=2:flags=area+accurate_rnd",
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
       "-c:a",
       "aac",
       "-b:a",
       "96k",
       "-ac",
       "2",
       "-map_metadata",
       "-1",
       "-fflags",
       "+bitexact",
       "-flags:v",
       "+bitexact",
       "-flags:a",
       "+bitexact",
       "-movflags",
       "+faststart",
       out},
      {},
      ""};
  if (run_process(encode) != 0) {
    return fail(ExitCode::kUnsupported, "video.ffmpeg", path,
                "FFmpeg could not encode it as H.264 (libx264) and AAC; its words are above",
                "install an FFmpeg with libx264, as Debian's is");
  }
  MODAR_ASSIGN(video.bytes, read_bytes(out));
  if (!view_mp4(video.bytes, video.info) && fits(video.info, most)) return video;
  return fail(ExitCode::kInvalidInput, "video.decode", path,
              "as H.264 it has no duration, or one of more than an hour", "shorten it");
}

Result<void> write_poster(const std::string& path, const std::string& png) {
  const int written = run_process({{"ffmpeg", "-loglevel", "error", "-nostdin", "-y", "-i", path,
                                    "-frames:v", "1", "-flags:v", "+bitexact", png},
                                   {},
                                   ""});
  return written == 0 ? Result<void>() : unreadable(path);
}

}  // namespace modar
