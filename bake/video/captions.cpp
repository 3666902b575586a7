#include <fstream>
#include <sstream>

#include "bake/process.hpp"
#include "bake/video/encode_video.hpp"
#include "formats/captions.hpp"

namespace modar {
namespace {

Result<std::string> read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (file) text << file.rdbuf();
  if (!file || file.bad()) {
    return fail(ExitCode::kIo, "io.open", path, "it cannot be read", "correct the name");
  }
  return text.str();
}

tl::unexpected<Error> no_captions(const std::string& path, const std::string& cause) {
  return fail(ExitCode::kInvalidInput, "captions.read", path, cause,
              "write a WebVTT file (WEBVTT, an empty line, 00:01.500 --> 00:04.000, the words), or "
              "SubRip");
}

}  // namespace

Result<std::string> read_captions(const std::string& path) {
  MODAR_ASSIGN(std::string text, read_text(path));
  if (!check_captions(text)) return text;
  const TemporaryFolder folder;
  const std::string out = folder.path() + "/out.vtt";
  const int read = run_process({{"ffmpeg", "-loglevel", "quiet", "-nostdin", "-i", path, "-map",
                                 "0:s:0", "-f", "webvtt", "-fflags", "+bitexact", out},
                                {},
                                ""});
  if (read != 0) return no_captions(path, "FFmpeg reads no captions from it");
  MODAR_ASSIGN(text, read_text(out));
  if (const auto fault = check_captions(text)) {
    return no_captions(path, "as WebVTT, line " + std::to_string(fault->line) +
                                 " of it is wrong: " + fault->cause);
  }
  return text;
}

}  // namespace modar
