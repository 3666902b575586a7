// Folders of PNG and H.264 movies; the library of media encodes both.
#include <sys/stat.h>

#include <cctype>
#include <cstdio>

#include "desk_media.hpp"
#include "formats/base/atomic_file.hpp"

namespace modar {
namespace {

Result<void> encode(const std::string& path, const std::uint8_t* pixels, int width, int height,
                    int channels) {
  MODAR_ASSIGN(const Media* library, media());
  auto file = library->encode_png(pixels, width, height, channels);
  if (file) return write_file(path, std::as_bytes(std::span(*file)));
  file.error().where = path;
  return tl::unexpected(file.error());
}

class PngFolder final : public FrameSink {
 public:
  explicit PngFolder(std::string folder) : folder_(std::move(folder)) {}

  Result<void> picture(const RgbaView& image, const FrameReport& report) override {
    char name[40];
    std::snprintf(name, sizeof name, "/frame_%06llu.png",
                  static_cast<unsigned long long>(report.frame));
    return write_png(folder_ + name, image);
  }

  Result<void> finish(std::string_view /*summary*/) override { return {}; }

 private:
  std::string folder_;
};

std::string parent_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

/// "x.txt": a new name with an ending of 2 to 4 letters and digits, of which the first is a letter.
bool named_as_file(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string::npos || dot == 0 || path[dot - 1] == '/') return false;
  const std::string_view ending = std::string_view(path).substr(dot + 1);
  if (ending.size() < 2 || ending.size() > 4) return false;
  if (std::isdigit(static_cast<unsigned char>(ending[0])) != 0) return false;
  for (const char c : ending) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) return false;
  }
  struct stat there {};
  return ::stat(path.c_str(), &there) != 0 || !S_ISDIR(there.st_mode);
}

}  // namespace

Result<void> write_png(const std::string& path, const RgbaView& image) {
  return encode(path, image.pixels.data(), image.width, image.height, 4);
}

Result<void> write_frame_picture(const std::string& path, const RgbImage& image) {
  return encode(path + ".png", image.pixels, image.width, image.height, 3);
}

Result<std::unique_ptr<FrameSink>> open_frame_sink(const std::string& out, double fps) {
  const bool movie = out.ends_with(".mp4");
  if (!movie && named_as_file(out)) {
    return fail(ExitCode::kUsage, "out.format", out, "it is neither FILE.mp4 nor a folder",
                "name a movie FILE.mp4, or a folder for pictures: with a slash at its end, as " +
                    out + "/, if its name is meant to end like this");
  }
  MODAR_TRY(make_folder(movie ? parent_of(out) : out));
  if (movie) {
    MODAR_ASSIGN(const Media* library, media());
    return library->open_movie(out, fps);
  }
  remove_frames(out);
  return std::make_unique<PngFolder>(out);
}

}  // namespace modar
