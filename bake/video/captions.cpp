#include "formats/captions.hpp"
#include "bake/io/input.hpp"
#include "bake/process/process.hpp"
#include "bake/video/encode_video.hpp"

namespace modar {
namespace {

tl::unexpected<Error> no_captions(const std::string& path, const std::string& cause) {
  return fail(ExitCode::kInvalidInput, "captions.read", path, cause,
              "write a WebVTT file (WEBVTT, an empty line, 00:01.500 --> 00:04.000, the words), or "
              "SubRip");
}

}  // namespace

Result<std::string> read_captions(const std::string& path) {
  const Result<std::string> as_it_is = read_file(path, kMostCaptionBytes);
  if (!as_it_is && as_it_is.error().exit == ExitCode::kIo) return as_it_is;
  if (as_it_is && !check_captions(*as_it_is)) return as_it_is;
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/out.vtt";
  const int read = run_process({{"ffmpeg", "-loglevel", "quiet", "-nostdin", "-i", path, "-map",
                                 "0:s:0", "-f", "webvtt", "-fflags", "+bitexact", out},
                                {},
                                ""});
  if (read != 0) return no_captions(path, "FFmpeg reads no captions from it");
  MODAR_ASSIGN(std::string text, read_file(out, kMostCaptionBytes));
  if (const auto fault = check_captions(text)) {
    return no_captions(path, "as WebVTT, line " + std::to_string(fault->line) +
                                 " of it is wrong: " + fault->cause);
  }
  return text;
}

}  // namespace modar
