// Videos, pictures, folders of pictures and cameras through OpenCV, which throws: caught here.
#include <dirent.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "desk_v4l2_source.hpp"
#include "frame_source.hpp"
#include "modar/video_reader.hpp"
#include "raw_source.hpp"

namespace modar {
namespace {

constexpr double kDefaultFps = 30;

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
  VideoSource(VideoReader reader, bool live) : reader_(std::move(reader)) {
    info_ = {reader_.fps(), reader_.frames(), live};
  }

  [[nodiscard]] SourceInfo info() const override { return info_; }

  Result<bool> next(Frame& frame) override {
    if (stopped_) return false;
    MODAR_ASSIGN(const bool more, reader_.next());
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
  SourceInfo info_;
  std::uint64_t next_ = 0;
  std::atomic<bool> stopped_{false};
};

/// One picture, or those of a folder in the order of their names.
class PictureSource final : public FrameSource {
 public:
  explicit PictureSource(std::vector<std::string> paths) : paths_(std::move(paths)) {}

  [[nodiscard]] SourceInfo info() const override { return {kDefaultFps, paths_.size(), false}; }

  Result<bool> next(Frame& frame) override {
    if (stopped_ || next_ == paths_.size()) return false;
    const std::string& path = paths_[next_];
    try {
      const cv::Mat picture = cv::imread(path, cv::IMREAD_COLOR);
      if (picture.empty()) return damaged(path, "the picture cannot be decoded");
      fill(frame, picture);
    } catch (const std::exception& error) {
      return damaged(path, std::string("OpenCV: ") + error.what());
    }
    frame.index = next_;
    frame.time_s = static_cast<double>(next_) / kDefaultFps;
    ++next_;
    return true;
  }

  void stop() override { stopped_ = true; }

 private:
  std::vector<std::string> paths_;
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

/// Ours first; a camera that sends compressed pictures only goes through OpenCV.
Result<std::unique_ptr<FrameSource>> open_camera(const std::string& input) {
  MODAR_ASSIGN(const int number, camera_number(input));
  MODAR_ASSIGN(auto device, open_video_device("/dev/video" + std::to_string(number)));
  auto source = start_camera(std::move(device), input, {});
  if (source || source.error().code != "camera.format") return source;
  auto reader = VideoReader::open_camera(number, input);
  if (!reader) return source;
  return std::make_unique<VideoSource>(std::move(*reader), true);
}

Result<std::unique_ptr<FrameSource>> open_file(const std::string& path) {
  if (cv::haveImageReader(path)) {
    return std::make_unique<PictureSource>(std::vector<std::string>{path});
  }
  MODAR_ASSIGN(VideoReader reader, VideoReader::open_file(path));
  return std::make_unique<VideoSource>(std::move(reader), false);
}

}  // namespace

Result<std::unique_ptr<FrameSource>> open_frame_source(const std::string& input) {
  try {
    silence_opencv();
    if (is_raw_input(input)) return open_raw_source(input);
    if (input == "camera" || input.starts_with("camera:")) return open_camera(input);
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

}  // namespace modar
