// Video4Linux2 by its ioctls: format, four mapped buffers, stream, one buffer out and in a frame.
#include "desk_v4l2_source.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "pipeline.hpp"
#include "raw_source.hpp"

namespace modar {
namespace {

struct Offered {
  std::uint32_t fourcc;
  YuvLayout layout;
};
/// In the order in which we like them: gray first needs no work, but has no colour to show.
constexpr std::array<Offered, 5> kFormats = {{{V4L2_PIX_FMT_NV12, YuvLayout::kNv12},
                                              {V4L2_PIX_FMT_NV21, YuvLayout::kNv21},
                                              {V4L2_PIX_FMT_YUV420, YuvLayout::kI420},
                                              {V4L2_PIX_FMT_YUYV, YuvLayout::kYuyv},
                                              {V4L2_PIX_FMT_GREY, YuvLayout::kGray}}};

class DeviceNode final : public VideoDevice {
 public:
  explicit DeviceNode(int descriptor) : descriptor_(descriptor) {}
  ~DeviceNode() override {
    for (const auto& part : maps_) munmap(part.data(), part.size());
    close(descriptor_);
  }

  int control(unsigned long request, void* argument) override {
    int answer = 0;
    do {
      answer = ioctl(descriptor_, request, argument);
    } while (answer < 0 && errno == EINTR);
    return answer < 0 ? errno : 0;
  }

  std::span<const std::uint8_t> map(std::size_t length, std::uint32_t offset) override {
    void* start = mmap(nullptr, length, PROT_READ, MAP_SHARED, descriptor_, offset);
    if (start == MAP_FAILED) return {};
    maps_.emplace_back(static_cast<std::uint8_t*>(start), length);
    return maps_.back();
  }

  WakeEvent::Event wait(const WakeEvent& wake, std::chrono::milliseconds limit) override {
    return wake.wait(descriptor_, limit);
  }

 private:
  int descriptor_;
  std::vector<std::span<std::uint8_t>> maps_;
};

class CameraSource final : public FrameSource {
 public:
  CameraSource(std::unique_ptr<VideoDevice> device, std::string name,
               const CaptureFormat& requested)
      : device_(std::move(device)), name_(std::move(name)), requested_(requested) {
    info_.live = true;
    info_.fps = requested.fps;
  }

  ~CameraSource() override {
    if (!streaming_) return;
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    device_->control(VIDIOC_STREAMOFF, &type);
  }

  Result<void> start() {
    MODAR_TRY(require_capture());
    MODAR_TRY(choose_format());
    choose_rate();
    MODAR_TRY(map_buffers());
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (const int error = device_->control(VIDIOC_STREAMON, &type)) return failed("start", error);
    streaming_ = true;
    return {};
  }

  [[nodiscard]] SourceInfo info() const override { return info_; }

  Result<bool> next(Frame& frame) override {
    for (;;) {
      switch (device_->wait(wake_, requested_.patience)) {
        case WakeEvent::Event::kStopped:
          return false;
        case WakeEvent::Event::kTimeout:
          return lost("it sends no frames any more");
        case WakeEvent::Event::kReadable:
          break;
      }
      const Result<bool> taken = take(frame);
      if (!taken || *taken) return taken;
    }
  }

  void stop() override { wake_.stop(); }

 private:
  [[nodiscard]] tl::unexpected<Error> lost(std::string cause) const {
    return fail(ExitCode::kIo, "camera.lost", name_, std::move(cause), "plug it in again");
  }

  [[nodiscard]] tl::unexpected<Error> failed(const char* what, int error) const {
    return fail(ExitCode::kIo, "input.read", name_,
                std::string("the camera does not ") + what + ": " + std::strerror(error),
                "close the program that uses it");
  }

  Result<void> require_capture() {
    v4l2_capability capability{};
    const int error = device_->control(VIDIOC_QUERYCAP, &capability);
    const std::uint32_t all = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                  ? capability.device_caps
                                  : capability.capabilities;
    constexpr std::uint32_t kNeeded = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    if (error == 0 && (all & kNeeded) == kNeeded) return {};
    return fail(ExitCode::kUnsupported, "camera.device", name_, "it is not a streaming camera",
                "try the next one: camera:1");
  }

  /// The first of kFormats that the device accepts unchanged.
  Result<void> choose_format() {
    for (const Offered& offered : kFormats) {
      v4l2_format format{};
      format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      format.fmt.pix.width = static_cast<std::uint32_t>(requested_.width);
      format.fmt.pix.height = static_cast<std::uint32_t>(requested_.height);
      format.fmt.pix.pixelformat = offered.fourcc;
      format.fmt.pix.field = V4L2_FIELD_NONE;
      if (const int error = device_->control(VIDIOC_S_FMT, &format); error == EBUSY) {
        return failed("let itself be set", error);
      } else if (error != 0 || format.fmt.pix.pixelformat != offered.fourcc) {
        continue;
      }
      format_.layout = offered.layout;
      format_.width = static_cast<int>(format.fmt.pix.width);
      format_.height = static_cast<int>(format.fmt.pix.height);
      format_.full_range = format.fmt.pix.quantization == V4L2_QUANTIZATION_FULL_RANGE;
      const std::uint32_t row = format.fmt.pix.bytesperline;
      const std::uint32_t tight = offered.layout == YuvLayout::kYuyv
                                      ? 4 * ((format.fmt.pix.width + 1) / 2)
                                      : format.fmt.pix.width;
      const bool good = format_.width >= 1 && format_.width <= 8192 && format_.height >= 1 &&
                        format_.height <= 8192 && (row == 0 || row == tight);
      if (good) return {};
    }
    return fail(ExitCode::kUnsupported, "camera.format", name_,
                "it offers none of NV12, NV21, I420, YUYV and grey without gaps",
                "convert it: ffmpeg -i /dev/video0 -f yuv4mpegpipe - | modar-play ... --input -");
  }

  /// The requested rate: a camera that ignores it plays at its own rate.
  void choose_rate() {
    v4l2_streamparm rate{};
    rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    rate.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(requested_.fps * 1000)};
    if (device_->control(VIDIOC_S_PARM, &rate) != 0) return;
    const v4l2_fract each = rate.parm.capture.timeperframe;
    if (each.numerator > 0 && each.denominator > 0) {
      info_.fps = static_cast<double>(each.denominator) / each.numerator;
    }
  }

  Result<void> map_buffers() {
    v4l2_requestbuffers request{};
    request.count = 4;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    if (const int error = device_->control(VIDIOC_REQBUFS, &request)) {
      return failed("give buffers", error);
    }
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer = empty_buffer();
      buffer.index = i;
      int error = device_->control(VIDIOC_QUERYBUF, &buffer);
      if (error != 0) return failed("tell its buffers", error);
      buffers_.push_back(device_->map(buffer.length, buffer.m.offset));
      if (buffers_.back().empty()) return failed("let its buffers be mapped", ENOMEM);
      error = device_->control(VIDIOC_QBUF, &buffer);
      if (error != 0) return failed("take its buffers", error);
    }
    if (!buffers_.empty()) return {};
    return failed("give buffers", ENOMEM);
  }

  static v4l2_buffer empty_buffer() {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    return buffer;
  }

  /// False: there was no whole frame after all.
  Result<bool> take(Frame& frame) {
    v4l2_buffer buffer = empty_buffer();
    const int error = device_->control(VIDIOC_DQBUF, &buffer);
    if (error == EAGAIN) return false;
    if (error != 0) return lost(std::string("it was lost: ") + std::strerror(error));
    const bool known = buffer.index < buffers_.size();
    const std::size_t needed = frame_bytes(format_);
    const bool whole = known && (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 &&
                       buffer.bytesused >= needed && buffers_[buffer.index].size() >= needed;
    if (whole) {
      fill_frame(frame, format_, buffers_[buffer.index]);
      if (next_ == 0) first_ns_ = now_ns();
      frame.index = next_++;
      frame.time_s = ms_since(first_ns_) / 1000.0;
    }
    if (known && device_->control(VIDIOC_QBUF, &buffer) != 0) return lost("it takes no buffers");
    return whole;
  }

  std::unique_ptr<VideoDevice> device_;
  std::string name_;
  CaptureFormat requested_;
  SourceInfo info_;
  YuvFormat format_;
  std::vector<std::span<const std::uint8_t>> buffers_;
  std::uint64_t next_ = 0;
  std::int64_t first_ns_ = 0;
  bool streaming_ = false;
  WakeEvent wake_;
};

}  // namespace

Result<std::unique_ptr<VideoDevice>> open_video_device(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (descriptor >= 0) return std::make_unique<DeviceNode>(descriptor);
  return fail(ExitCode::kIo, "input.open", path,
              std::string("the camera cannot be opened: ") + std::strerror(errno),
              "plug one in, or join the group video");
}

Result<std::unique_ptr<FrameSource>> start_camera(std::unique_ptr<VideoDevice> device,
                                                  const std::string& name,
                                                  const CaptureFormat& requested) {
  auto source = std::make_unique<CameraSource>(std::move(device), name, requested);
  MODAR_TRY(source->start());
  return source;
}

Result<int> camera_number(const std::string& input) {
  constexpr std::string_view kCamera = "camera";
  int number = 0;
  if (input == kCamera) return number;
  const char* first = input.data() + kCamera.size() + 1;
  const char* end = input.data() + input.size();
  const auto [last, error] = std::from_chars(first, end, number);
  if (error == std::errc() && last == end && number >= 0) return number;
  return fail(ExitCode::kUsage, "input.camera", input, "it is not a camera",
              "write camera, or camera:1 for the second one");
}

}  // namespace modar
