// The library that is loaded for pictures and videos: OpenCV and FFmpeg, which throw: caught here.
#include <dirent.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "desk_media.hpp"
#include "desk_sound_reader.hpp"
#include "formats/base/atomic_file.hpp"
#include "modar/mapped_file.hpp"
#include "modar/video_reader.hpp"

namespace modar {
namespace {

constexpr double kDefaultFps = 30;
/// Of a still: larger ones are reduced, since the player takes 50 bytes a pixel.
constexpr double kMostPixels = 12.5e6;

tl::unexpected<Error> damaged(const std::string& path, const std::string& cause) {
  return fail(ExitCode::kInvalidInput, "input.damaged", path, cause,
              "give a video or picture that other players show");
}

/// Blue, green, red (or gray) pixels into the frame's own buffers.
void fill(Frame& frame, const cv::Mat& picture) {
  frame.width = picture.cols;
  frame.height = picture.rows;
  const auto pixels =
      static_cast<std::size_t>(picture.cols) * static_cast<std::size_t>(picture.rows);
  frame.rgb.resize(3 * pixels);
  frame.gray.resize(pixels);
  cv::Mat rgb(picture.rows, picture.cols, CV_8UC3, frame.rgb.data());
  cv::Mat gray(picture.rows, picture.cols, CV_8UC1, frame.gray.data());
  cv::cvtColor(picture, rgb, cv::COLOR_BGR2RGB);
  cv::cvtColor(picture, gray, cv::COLOR_BGR2GRAY);
}

/// A video file or a camera.
class VideoSource final : public FrameSource {
 public:
  VideoSource(VideoReader reader, std::string name, bool live)
      : reader_(std::move(reader)), name_(std::move(name)) {
    info_ = {reader_.fps(), reader_.frames(), live, false};
  }

  [[nodiscard]] SourceInfo info() const override { return info_; }

  Result<bool> next(Frame& frame) override {
    if (stopped_) return false;
    MODAR_ASSIGN(const bool more, reader_.next());
    // Stated numbers are rounded, and estimates in some formats.
    if (!more && !info_.live &&
        static_cast<double>(next_) < 0.9 * static_cast<double>(info_.frames)) {
      std::fprintf(stderr, "modar-play: %s: it ends after %llu of %llu frames; copy it again\n",
                   printable(name_).c_str(), static_cast<unsigned long long>(next_),
                   static_cast<unsigned long long>(info_.frames));
    }
    if (!more) return false;
    const BgrPicture picture = reader_.picture();
    fill(frame, {picture.height, picture.width, CV_8UC3, const_cast<std::uint8_t*>(picture.pixels),
                 picture.stride});
    frame.index = next_;
    frame.time_s = static_cast<double>(next_) / info_.fps;
    ++next_;
    return true;
  }

  void stop() override { stopped_ = true; }

 private:
  VideoReader reader_;
  std::string name_;
  SourceInfo info_;
  std::uint64_t next_ = 0;
  std::atomic<bool> stopped_{false};
};

/// Brightness on a coarse grid: tells whether a picture continues the one before it.
class SceneChange {
 public:
  /// True if the frame shows another scene than the frame of the last call.
  bool step(const GrayImage& frame) {
    std::array<double, kGrid * kGrid> now{};
    for (int y = 0; y < kGrid; ++y) {
      for (int x = 0; x < kGrid; ++x)
        now[static_cast<std::size_t>(y * kGrid + x)] = mean(frame, x, y);
    }
    const double sum = std::accumulate(now.begin(), now.end(), 0.0);
    for (double& value : now) value -= sum / static_cast<double>(now.size());
    const auto dot = [](const auto& a, const auto& b) {
      return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
    };
    const bool same = dot(now, last_) >= kSameScene * std::sqrt(dot(now, now) * dot(last_, last_));
    last_ = now;
    return !same;
  }

 private:
  static constexpr int kGrid = 12;
  /// Least correlation of two grids of one scene. Lower: a photo of something else continues the
  /// one before; higher: fast motion in a video's frames restarts the tracker. [0.75, 0.9]
  static constexpr double kSameScene = 0.8;

  static double mean(const GrayImage& frame, int column, int row) {
    const int left = frame.width * column / kGrid;
    const int right = std::max(left + 1, frame.width * (column + 1) / kGrid);
    const int top = frame.height * row / kGrid;
    const int bottom = std::max(top + 1, frame.height * (row + 1) / kGrid);
    double sum = 0;
    for (int y = top; y < bottom; ++y) {
      const std::uint8_t* line = frame.pixels + y * frame.stride;
      sum = std::accumulate(line + left, line + right, sum);
    }
    return sum / ((right - left) * (bottom - top));
  }

  std::array<double, kGrid * kGrid> last_{};
};

/// While it exists, text for stderr is kept instead: codecs write there by themselves. Other
/// threads that print there wait.
class KeptErrors {
 public:
  KeptErrors() : before_(dup(STDERR_FILENO)), kept_(memfd_create("said", MFD_CLOEXEC)) {
    flockfile(stderr);
    if (before_ >= 0 && kept_ >= 0) dup2(kept_, STDERR_FILENO);
  }
  KeptErrors(const KeptErrors&) = delete;
  KeptErrors& operator=(const KeptErrors&) = delete;
  ~KeptErrors() {
    if (before_ >= 0 && kept_ >= 0) dup2(before_, STDERR_FILENO);
    funlockfile(stderr);
    if (before_ >= 0) close(before_);
    if (kept_ >= 0) close(kept_);
  }
  /// The beginning of that text.
  [[nodiscard]] std::string text() const {
    std::string said(4096, 0);
    const ssize_t length = pread(kept_, said.data(), said.size(), 0);
    said.resize(length < 0 ? 0 : static_cast<std::size_t>(length));
    return said;
  }

 private:
  int before_;
  int kept_;
};

/// Whether a JPEG without an end marker lacks a scan, which libjpeg does not say. A progressive
/// one sends the bits of its coefficients in several.
bool lacks_scans(std::span<const std::uint8_t> jpeg) {
  std::array<std::array<int, 64>, 256> missing{};  // bits, by component and coefficient
  for (std::size_t at = 2; at + 4 <= jpeg.size();) {
    const int marker = jpeg[at + 1];
    const bool alone = marker <= 1 || (marker >= 0xD0 && marker <= 0xD8) || marker == 0xFF;
    if (jpeg[at] != 0xFF || alone) {  // within a scan
      ++at;
      continue;
    }
    if (marker == 0xD9) return false;
    const std::size_t end = at + 2 + (std::size_t{jpeg[at + 2]} << 8U) + jpeg[at + 3];
    const bool frame = marker >= 0xC0 && marker <= 0xC2;
    const bool scan = marker == 0xDA;
    const std::size_t list = at + (frame ? 10 : 5);
    const std::size_t step = frame ? 3 : 2;
    if ((frame || scan) && list < jpeg.size()) {
      const std::size_t last = list + step * jpeg[list - 1];
      if (last + 3 > jpeg.size()) return true;
      for (std::size_t i = list; i < last; i += step) {
        if (frame) missing[jpeg[i]].fill(1);
        for (int k = jpeg[last]; scan && k <= std::min<int>(jpeg[last + 1], 63); ++k) {
          missing[jpeg[i]][static_cast<std::size_t>(k)] = jpeg[last + 2] & 15;
        }
      }
    }
    at = end;
  }
  return std::ranges::any_of(missing, [](const auto& component) {
    return std::ranges::any_of(component, [](int bits) { return bits > 0; });
  });
}

/// Decodes a picture, and says whether pixels of a JPEG are lost: by the same warnings of libjpeg
/// as bake/image/jpeg.cpp.
cv::Mat decode(std::span<const std::byte> file, bool& lost) {
  std::vector<std::uint8_t> bytes(file.size());
  std::memcpy(bytes.data(), file.data(), file.size());
  // Where only the end marker is missing, nothing is lost, and where more is, libjpeg says so.
  if (bytes.front() == 0xFF) bytes.insert(bytes.end(), {0xFF, 0xD9});
  const KeptErrors kept;
  cv::Mat picture = cv::imdecode(bytes, cv::IMREAD_COLOR);
  const std::string said = kept.text();
  constexpr std::array<std::string_view, 3> kLost = {"premature end of data", "bad Huffman code",
                                                     "instead of RST"};
  lost = std::ranges::any_of(kLost, [&](auto words) { return said.find(words) != said.npos; });
  lost = lost || (bytes.front() == 0xFF && lacks_scans(std::span(bytes).first(file.size())));
  return picture;
}

Result<void> read_picture(const std::string& path, Frame& frame) {
  struct stat status {};
  if (access(path.c_str(), R_OK) != 0 || stat(path.c_str(), &status) != 0) {
    return fail(ExitCode::kIo, "input.open", path, std::strerror(errno), "check its permissions");
  }
  if (!S_ISREG(status.st_mode)) return damaged(path, "it is not a regular file");
  if (status.st_size == 0) return damaged(path, "the file is empty");
  try {
    MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
    bool lost = false;
    cv::Mat picture = decode(file.bytes(), lost);
    if (picture.empty()) return damaged(path, "the picture cannot be decoded");
    if (lost) {
      std::fprintf(stderr, "modar-play: %s: a part of the picture is missing; copy it again\n",
                   printable(path).c_str());
    }
    const double scale = std::sqrt(kMostPixels / static_cast<double>(picture.total()));
    if (scale < 1) {
      cv::Mat reduced;
      cv::resize(picture, reduced, {}, scale, scale, cv::INTER_AREA);
      std::fprintf(stderr, "modar-play: %s: reduced from %dx%d to %dx%d pixels\n",
                   printable(path).c_str(), picture.cols, picture.rows, reduced.cols, reduced.rows);
      picture = reduced;
    }
    frame.reduced = std::max(1.0, 1 / scale);
    fill(frame, picture);
  } catch (const std::exception& error) {
    return damaged(path, std::string("OpenCV: ") + error.what());
  }
  return {};
}

/// One picture, or those of a folder in the order of their names. Of several, those that cannot be
/// read are skipped.
class PictureSource final : public FrameSource {
 public:
  explicit PictureSource(std::vector<std::string> paths) : paths_(std::move(paths)) {}

  [[nodiscard]] SourceInfo info() const override {
    return {kDefaultFps, paths_.size(), false, true};
  }

  Result<bool> next(Frame& frame) override {
    for (; !stopped_ && next_ < paths_.size(); ++next_) {
      if (const auto read = read_picture(paths_[next_], frame); !read) {
        skipped_.push_back(read.error());
        continue;
      }
      frame.new_scene = scene_.step(frame.gray_image());
      frame.index = next_;
      frame.time_s = static_cast<double>(next_) / kDefaultFps;
      ++next_;
      return true;
    }
    if (skipped_.size() < paths_.size()) return false;
    Error first = skipped_.front();
    if (paths_.size() > 1) {
      first.cause += "; none of the " + std::to_string(paths_.size()) + " pictures can be read";
    }
    return tl::unexpected(std::move(first));
  }

  void stop() override { stopped_ = true; }
  [[nodiscard]] std::span<const Error> skipped() const override { return skipped_; }

 private:
  std::vector<std::string> paths_;
  std::vector<Error> skipped_;
  SceneChange scene_;
  std::size_t next_ = 0;
  std::atomic<bool> stopped_{false};
};

bool is_picture_name(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot == 0) return false;
  std::string ending = name.substr(dot + 1);
  for (char& letter : ending) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  constexpr std::array<std::string_view, 9> kEndings = {"png", "jpg", "jpeg", "bmp", "ppm",
                                                        "pgm", "tif", "tiff", "webp"};
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

Result<std::unique_ptr<FrameSource>> open_folder(const std::string& folder) {
  DIR* open = opendir(folder.c_str());
  if (open == nullptr) {
    return fail(ExitCode::kIo, "input.open", folder, "the folder cannot be read",
                "check its permissions");
  }
  std::vector<std::string> paths;
  while (const dirent* entry = readdir(open)) {
    if (is_picture_name(entry->d_name)) paths.push_back(folder + "/" + entry->d_name);
  }
  closedir(open);
  std::sort(paths.begin(), paths.end());
  if (paths.empty()) {
    return fail(ExitCode::kInvalidInput, "input.empty", folder, "the folder holds no picture",
                "give one with PNG, JPEG, BMP, PPM, TIFF or WebP files");
  }
  return std::make_unique<PictureSource>(std::move(paths));
}

/// Bytes under a path, as OpenCV wants them.
class MemoryFile {
 public:
  explicit MemoryFile(std::span<const std::byte> bytes)
      : descriptor_(memfd_create("clip", MFD_CLOEXEC)) {
    while (!bytes.empty()) {
      const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
      if (written <= 0) return;
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    whole_ = true;
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  [[nodiscard]] bool whole() const { return whole_; }
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
  bool whole_ = false;
};

class VideoClip final : public ClipReader {
 public:
  VideoClip(std::span<const std::byte> file, std::string name)
      : file_(file), name_(std::move(name)) {}

  Result<void> open() {
    if (!file_.whole()) {
      return fail(ExitCode::kIo, "input.open", name_, "there is not enough memory for the video",
                  "free some");
    }
    MODAR_TRY(restart());
    MODAR_ASSIGN(const bool any, decode());
    return any ? Result<void>() : damaged(name_, "the video has no picture");
  }

  Result<bool> seek(double seconds) override {
    // Times of files are rounded: a picture whose time comes within this begins now, seconds.
    constexpr double kSlack = 1e-4;
    const bool back = pictures_ > 0 && seconds + kSlack < begins_;
    if (back) {
      MODAR_TRY(restart());
      MODAR_TRY(decode());
    }
    bool another = back || pictures_ == 0;
    while (more_ && next_begins_ <= seconds + kSlack) {
      show_next();
      another = true;
      MODAR_TRY(decode());
    }
    if (pictures_ > 0) return another;
    show_next();  // a track that begins later than the file represents it until then
    MODAR_TRY(decode());
    return true;
  }

  [[nodiscard]] RgbImage picture() const override {
    return {shown_.data, shown_.cols, shown_.rows, static_cast<std::ptrdiff_t>(shown_.step[0])};
  }

 private:
  Result<void> restart() {
    MODAR_ASSIGN(VideoReader reader, VideoReader::open_file(file_.path()));
    reader_ = std::make_unique<VideoReader>(std::move(reader));
    pictures_ = 0;
    return {};
  }

  /// The picture after the shown one, for its time.
  Result<bool> decode() {
    MODAR_ASSIGN(more_, reader_->next());
    if (more_) next_begins_ = reader_->time_s();
    return more_;
  }

  void show_next() {
    const BgrPicture picture = reader_->picture();
    const cv::Mat bgr(picture.height, picture.width, CV_8UC3,
                      const_cast<std::uint8_t*>(picture.pixels), picture.stride);
    cv::cvtColor(bgr, shown_, cv::COLOR_BGR2RGB);
    begins_ = next_begins_;
    ++pictures_;
  }

  MemoryFile file_;
  std::string name_;
  std::unique_ptr<VideoReader> reader_;
  cv::Mat shown_;
  std::uint64_t pictures_ = 0;  ///< shown since the file began
  double begins_ = 0;           ///< the shown one, seconds
  double next_begins_ = 0;
  bool more_ = false;
};

Result<std::unique_ptr<ClipReader>> open_clip(std::span<const std::byte> file,
                                              const std::string& name) {
  try {
    auto clip = std::make_unique<VideoClip>(file, name);
    MODAR_TRY(clip->open());
    return clip;
  } catch (const std::exception& error) {
    return damaged(name, std::string("OpenCV: ") + error.what());
  }
}

Result<std::unique_ptr<FrameSource>> open_camera(int number, const std::string& name) {
  MODAR_ASSIGN(VideoReader reader, VideoReader::open_camera(number, name));
  return std::make_unique<VideoSource>(std::move(reader), name, true);
}

Result<std::unique_ptr<FrameSource>> open_file(const std::string& path) {
  if (cv::haveImageReader(path)) {
    return std::make_unique<PictureSource>(std::vector<std::string>{path});
  }
  MODAR_ASSIGN(VideoReader reader, VideoReader::open_file(path));
  return std::make_unique<VideoSource>(std::move(reader), path, false);
}

Result<std::unique_ptr<FrameSource>> open_path(const std::string& input) {
  try {
    silence_opencv();
    if (input.find("://") != input.npos) {
      return fail(ExitCode::kIo, "input.open", input, "this is an address, not a file",
                  "download it first, and pass the file");
    }
    struct stat status {};
    if (stat(input.c_str(), &status) != 0) {
      return fail(ExitCode::kIo, "input.open", input, "there is no such file or folder",
                  "check the path");
    }
    return S_ISDIR(status.st_mode) ? open_folder(input) : open_file(input);
  } catch (const std::exception& error) {
    return damaged(input, std::string("OpenCV: ") + error.what());
  }
}

tl::unexpected<Error> opencv_failed(const std::string& where, const char* what) {
  return fail(ExitCode::kIo, "out.write", where, std::string("OpenCV: ") + what,
              "check the free space and the size of the pictures");
}

/// The pixels as OpenCV takes them, not copied; nothing here writes through it.
cv::Mat wrap(const RgbaView& image) {
  return {image.height, image.width, CV_8UC4, const_cast<std::uint8_t*>(image.pixels.data())};
}

/// The encoder writes to a file next to the movie's place; finish() puts it there.
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

Result<std::unique_ptr<FrameSink>> open_movie(const std::string& path, double fps) {
  return std::make_unique<Movie>(path, fps);
}

Result<std::vector<std::uint8_t>> encode_png(const std::uint8_t* pixels, int width, int height,
                                             int channels) {
  try {
    const cv::Mat source(height, width, CV_8UC(channels), const_cast<std::uint8_t*>(pixels));
    cv::Mat bgr;
    cv::cvtColor(source, bgr, channels == 4 ? cv::COLOR_RGBA2BGR : cv::COLOR_RGB2BGR);
    std::vector<std::uint8_t> file;
    if (cv::imencode(".png", bgr, file)) return file;
    return opencv_failed("", "the picture is not encoded");
  } catch (const std::exception& error) {
    return opencv_failed("", error.what());
  }
}

}  // namespace
}  // namespace modar

extern "C" const modar::Media* modar_play_media() {
  static const modar::Media media = {modar::open_path,  modar::open_camera, modar::open_movie,
                                     modar::encode_png, modar::open_clip,   modar::open_sound};
  return &media;
}
