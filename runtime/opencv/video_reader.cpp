// Wraps cv::VideoCapture; catches what it throws.
#include "modar/video_reader.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/display.h>
}

#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace modar {
namespace {

constexpr double kDefaultFps = 30;  // of videos that state none: what most cameras record

tl::unexpected<Error> damaged(const std::string& name, const std::string& cause) {
  return fail(ExitCode::kInvalidInput, "input.damaged", name, cause,
              "give a video or picture that other players show");
}

/// How the pictures of a file are to be turned: transposed first, then mirrored.
struct Turn {
  bool transpose = false;
  bool mirror_x = false;
  bool mirror_y = false;

  [[nodiscard]] cv::Mat of(const cv::Mat& picture) const {
    cv::Mat turned = picture;
    if (transpose) cv::transpose(picture, turned);
    if (mirror_x || mirror_y) {
      cv::Mat mirrored;
      cv::flip(turned, mirrored, mirror_x && mirror_y ? -1 : (mirror_x ? 1 : 0));
      turned = mirrored;
    }
    return turned;
  }
};

/// By the display matrix of the file's video. OpenCV's own turning is off by 180 degrees where
/// OpenCV 4.6 reads with FFmpeg 5.
Turn read_turn(const std::string& path) {
  AVFormatContext* format = nullptr;
  if (avformat_open_input(&format, path.c_str(), nullptr, nullptr) < 0) return {};
  const std::unique_ptr<AVFormatContext*, void (*)(AVFormatContext**)> closed(&format,
                                                                              avformat_close_input);
  if (avformat_find_stream_info(format, nullptr) < 0) return {};
  const int best = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (best < 0) return {};
  std::size_t bytes = 0;
  const std::uint8_t* data =
      av_stream_get_side_data(format->streams[best], AV_PKT_DATA_DISPLAYMATRIX, &bytes);
  std::array<std::int32_t, 9> matrix{};
  if (data == nullptr || bytes < sizeof matrix) return {};
  std::memcpy(matrix.data(), data, sizeof matrix);
  // (x, y) is shown at (m0 x + m3 y, m1 x + m4 y). Turns by other than quarters show as the
  // nearest.
  const bool transpose = std::abs(std::int64_t{matrix[1]}) > std::abs(std::int64_t{matrix[0]});
  return {transpose, matrix[transpose ? 3 : 0] < 0, matrix[transpose ? 1 : 4] < 0};
}

}  // namespace

struct VideoReader::State {
  cv::VideoCapture capture;
  Turn turn;
  cv::Mat decoded;
  std::string name;
  bool live = false;
  bool any = false;  ///< a frame has been decoded
  cv::Mat picture;
  cv::Mat gray;
};

VideoReader::VideoReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
VideoReader::VideoReader(VideoReader&&) noexcept = default;
VideoReader::~VideoReader() = default;

void silence_opencv() {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
}

Result<VideoReader> VideoReader::open_file(const std::string& path) {
  silence_opencv();
  try {
    auto state = std::make_unique<State>();
    state->name = path;
    if (!state->capture.open(path, cv::CAP_FFMPEG)) {
      return damaged(path, "it is neither a picture nor a video");
    }
    state->capture.set(cv::CAP_PROP_ORIENTATION_AUTO, 0);
    state->turn = read_turn(path);
    return VideoReader(std::move(state));
  } catch (const std::exception& thrown) {
    return damaged(path, std::string("OpenCV: ") + thrown.what());
  }
}

Result<VideoReader> VideoReader::open_camera(int number, const std::string& name) {
  silence_opencv();
  try {
    auto state = std::make_unique<State>();
    state->name = name;
    state->live = true;
    if (state->capture.open(number, cv::CAP_V4L2)) {
      state->capture.set(cv::CAP_PROP_BUFFERSIZE, 1);
      return VideoReader(std::move(state));
    }
    return fail(ExitCode::kIo, "input.open", name, "the camera cannot be opened",
                "check that it is connected and that no other program uses it");
  } catch (const std::exception& thrown) {
    return damaged(name, std::string("OpenCV: ") + thrown.what());
  }
}

double VideoReader::fps() const {
  const double fps = state_->capture.get(cv::CAP_PROP_FPS);
  return std::isfinite(fps) && fps >= 1 && fps <= 1000 ? fps : kDefaultFps;
}

std::uint64_t VideoReader::frames() const {
  const double count = state_->live ? 0 : state_->capture.get(cv::CAP_PROP_FRAME_COUNT);
  return std::isfinite(count) && count > 0 ? static_cast<std::uint64_t>(count) : 0;
}

Result<bool> VideoReader::next() {
  try {
    if (!state_->capture.read(state_->decoded) || state_->decoded.empty()) {
      if (state_->any && !state_->live) return false;
      return damaged(state_->name, state_->live ? "the camera gives no more frames"
                                                : "the video has no frame that can be decoded");
    }
    state_->picture = state_->turn.of(state_->decoded);
    state_->any = true;
    return true;
  } catch (const std::exception& thrown) {
    return damaged(state_->name, std::string("OpenCV: ") + thrown.what());
  }
}

double VideoReader::time_s() const {
  const double ms = state_->capture.get(cv::CAP_PROP_POS_MSEC);
  return std::isfinite(ms) ? ms / 1000.0 : 0.0;
}

BgrPicture VideoReader::picture() const {
  const cv::Mat& picture = state_->picture;
  return {picture.data, picture.cols, picture.rows, picture.step[0]};
}

GrayImage VideoReader::gray() {
  cv::cvtColor(state_->picture, state_->gray, cv::COLOR_BGR2GRAY);
  const cv::Mat& gray = state_->gray;
  return {gray.data, gray.cols, gray.rows, static_cast<std::ptrdiff_t>(gray.step[0])};
}

}  // namespace modar
