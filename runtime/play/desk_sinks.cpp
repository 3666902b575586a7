// Folders of PNG and H.264 movies through OpenCV, which throws: caught here.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "formats/atomic_file.hpp"
#include "frame_sink.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

tl::unexpected<Error> opencv_failed(const std::string& where, const char* what) {
  return fail(ExitCode::kIo, "out.write", where, std::string("OpenCV: ") + what,
              "check the free space and the size of the pictures");
}

/// The pixels as OpenCV takes them, not copied; nothing here writes through it.
cv::Mat wrap(const RgbaView& image) {
  return {image.height, image.width, CV_8UC4, const_cast<std::uint8_t*>(image.pixels.data())};
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

/// The encoder writes beside the movie's place; finish() puts it there.
class Movie final : public FrameSink {
 public:
  Movie(std::string path, double fps)
      : path_(std::move(path)),
        temporary_(path_ + "." + std::to_string(getpid()) + ".encoding.mp4"),
        fps_(fps) {}

  ~Movie() override {
    writer_.release();
    std::remove(temporary_.c_str());
  }

  Result<void> picture(const RgbaView& image, const FrameReport& report) override {
    try {
      if (!writer_.isOpened()) {
        MODAR_TRY(open(image));
      }
      if (image.width != width_ || image.height != height_) {
        return fail(ExitCode::kInvalidInput, "out.size-changed", path_,
                    "frame " + std::to_string(report.frame) + " is of another size than the first",
                    "write pictures into a folder instead");
      }
      cv::cvtColor(wrap(image)(even_), bgr_, cv::COLOR_RGBA2BGR);
      writer_.write(bgr_);
    } catch (const std::exception& error) {
      return opencv_failed(path_, error.what());
    }
    return {};
  }

  Result<void> finish(std::string_view /*summary*/) override {
    if (!writer_.isOpened()) {
      return fail(ExitCode::kInvalidInput, "out.empty", path_, "there is no frame to write",
                  "give an input with frames");
    }
    try {
      writer_.release();
    } catch (const std::exception& error) {
      return opencv_failed(path_, error.what());
    }
    MODAR_ASSIGN(const MappedFile movie, MappedFile::open(temporary_));
    return write_file(path_, movie.bytes());
  }

 private:
  Result<void> open(const RgbaView& image) {
    width_ = image.width;
    height_ = image.height;
    // Chroma of half size needs even sides: an odd last row or column is left out.
    even_ = cv::Rect(0, 0, width_ & ~1, height_ & ~1);
    if (even_.area() == 0) {
      return fail(ExitCode::kInvalidInput, "out.size", path_, "a movie needs two pixels a side",
                  "write pictures into a folder instead");
    }
    // One thread: the encoder's choices depend on how many it has, and so would the bytes.
    setenv("OPENCV_FFMPEG_WRITER_OPTIONS", "threads;1|preset;veryfast|crf;20", 0);
    const int code = cv::VideoWriter::fourcc('a', 'v', 'c', '1');
    if (!writer_.open(temporary_, cv::CAP_FFMPEG, code, fps_, even_.size())) {
      return fail(ExitCode::kIo, "out.create", path_, "the movie cannot be opened for writing",
                  "check that its folder is there, and that FFmpeg has an H.264 encoder");
    }
    return {};
  }

  std::string path_;
  std::string temporary_;
  double fps_;
  int width_ = 0;
  int height_ = 0;
  cv::Rect even_;
  cv::Mat bgr_;
  cv::VideoWriter writer_;
};

std::string parent_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

}  // namespace

Result<void> write_png(const std::string& path, const RgbaView& image) {
  std::vector<std::uint8_t> file;
  try {
    cv::Mat bgr;
    cv::cvtColor(wrap(image), bgr, cv::COLOR_RGBA2BGR);
    if (!cv::imencode(".png", bgr, file)) return opencv_failed(path, "the picture is not encoded");
  } catch (const std::exception& error) {
    return opencv_failed(path, error.what());
  }
  return write_file(path, std::as_bytes(std::span(file)));
}

Result<void> write_frame_picture(const std::string& path, const RgbImage& image) {
  std::vector<std::uint8_t> file;
  try {
    const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.pixels),
                      static_cast<std::size_t>(image.stride));
    cv::Mat bgr;
    cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
    if (!cv::imencode(".png", bgr, file)) return opencv_failed(path, "the picture is not encoded");
  } catch (const std::exception& error) {
    return opencv_failed(path, error.what());
  }
  return write_file(path + ".png", std::as_bytes(std::span(file)));
}

Result<std::unique_ptr<FrameSink>> open_frame_sink(const std::string& out, double fps) {
  for (const char* other : {".avi", ".mkv", ".mov", ".webm", ".gif", ".png", ".jpg"}) {
    if (out.ends_with(other)) {
      return fail(ExitCode::kUsage, "out.format", out, "it is neither FILE.mp4 nor a folder",
                  "name a movie FILE.mp4, or a folder for pictures");
    }
  }
  const bool movie = out.ends_with(".mp4");
  MODAR_TRY(make_folder(movie ? parent_of(out) : out));
  if (movie) return std::make_unique<Movie>(out, fps);
  remove_frames(out);
  return std::make_unique<PngFolder>(out);
}

}  // namespace modar
