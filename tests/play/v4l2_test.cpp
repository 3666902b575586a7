// The camera source on a camera of our own: it speaks the protocol of Video4Linux2 and can fail.
#include "runtime/play/desk_v4l2_source.hpp"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <cerrno>
#include <deque>
#include <thread>

namespace modar {
namespace {

using std::chrono::milliseconds;

/// Frame n is gray of value n in every pixel (YUYV, no colour).
struct FakeCamera final : VideoDevice {
  std::uint32_t format = V4L2_PIX_FMT_YUYV;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::uint32_t row_bytes = 0;
  int frames = 5;         ///< then it falls silent
  int unplugged_at = -1;  ///< DQBUF answers ENODEV
  int torn = -1;          ///< that frame comes with the error flag
  int empty_wakes = 0;    ///< readable, but EAGAIN
  bool busy = false;
  bool* stream_off = nullptr;  ///< set when the stream ends

  int control(unsigned long request, void* argument) override {
    switch (request) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = capabilities;
        return 0;
      case VIDIOC_S_FMT:
        return set_format(*static_cast<v4l2_format*>(argument));
      case VIDIOC_S_PARM:
        static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {1, 25};
        return 0;
      case VIDIOC_REQBUFS:
        static_cast<v4l2_requestbuffers*>(argument)->count = 3;
        memory.assign(3, std::vector<std::uint8_t>(kBytes));
        return 0;
      case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        buffer.length = kBytes;
        buffer.m.offset = buffer.index;
        return 0;
      }
      case VIDIOC_QBUF:
        queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
        return 0;
      case VIDIOC_STREAMOFF:
        if (stream_off != nullptr) *stream_off = true;
        return 0;
      default:
        return ENOTTY;
    }
  }

  std::span<const std::uint8_t> map(std::size_t /*length*/, std::uint32_t offset) override {
    return memory[offset];
  }

  WakeEvent::Event wait(const WakeEvent& wake, milliseconds limit) override {
    const bool ready = next < frames || next == unplugged_at;
    return wake.wait_for_stop(ready ? milliseconds(0) : limit) == WakeEvent::Event::kStopped
               ? WakeEvent::Event::kStopped
           : ready ? WakeEvent::Event::kReadable
                   : WakeEvent::Event::kTimeout;
  }

 private:
  static constexpr std::uint32_t kWidth = 6;
  static constexpr std::uint32_t kHeight = 4;
  static constexpr std::uint32_t kBytes = kWidth * kHeight * 2;

  int set_format(v4l2_format& wanted) const {
    if (busy) return EBUSY;
    wanted.fmt.pix.pixelformat = format;  // a driver answers with what it has
    wanted.fmt.pix.width = kWidth;
    wanted.fmt.pix.height = kHeight;
    wanted.fmt.pix.bytesperline = row_bytes;
    wanted.fmt.pix.quantization = V4L2_QUANTIZATION_FULL_RANGE;
    return 0;
  }

  int dequeue(v4l2_buffer& buffer) {
    if (empty_wakes-- > 0) return EAGAIN;
    if (next == unplugged_at) return ENODEV;
    EXPECT_FALSE(queued.empty()) << "the source gives its buffers back";
    if (queued.empty()) return EINVAL;
    buffer.index = queued.front();
    queued.pop_front();
    for (std::size_t i = 0; i < kBytes; i += 2) {
      memory[buffer.index][i] = static_cast<std::uint8_t>(next);
      memory[buffer.index][i + 1] = 128;
    }
    buffer.bytesused = kBytes;
    buffer.flags = next == torn ? V4L2_BUF_FLAG_ERROR : 0u;
    ++next;
    return 0;
  }

  int next = 0;
  std::vector<std::vector<std::uint8_t>> memory;
  std::deque<std::uint32_t> queued;
};

Result<std::unique_ptr<FrameSource>> start(std::unique_ptr<FakeCamera> camera) {
  CaptureFormat wish;
  wish.patience = milliseconds(20);
  return start_camera(std::move(camera), "camera", wish);
}

TEST(Camera, GivesEachFrameAndItsBuffersBack) {
  bool off = false;
  {
    auto camera = std::make_unique<FakeCamera>();
    camera->frames = 20;
    camera->empty_wakes = 2;
    camera->stream_off = &off;
    auto source = start(std::move(camera));
    ASSERT_TRUE(source) << to_line(source.error());
    EXPECT_TRUE((*source)->info().live);
    EXPECT_EQ((*source)->info().fps, 25);
    Frame frame;
    for (std::uint8_t i = 0; i < 20; ++i) {
      ASSERT_TRUE(*(*source)->next(frame));
      EXPECT_EQ(frame.width, 6);
      EXPECT_EQ(frame.height, 4);
      EXPECT_EQ(frame.gray, std::vector<std::uint8_t>(24, i));
      EXPECT_EQ(frame.index, i);
    }
    EXPECT_EQ((*source)->next(frame).error().code, "camera.lost") << "silence";
  }
  EXPECT_TRUE(off);
}

TEST(Camera, SkipsATornFrame) {
  auto camera = std::make_unique<FakeCamera>();
  camera->torn = 1;
  auto source = start(std::move(camera));
  ASSERT_TRUE(source);
  Frame frame;
  for (const int value : {0, 2, 3}) {
    ASSERT_TRUE(*(*source)->next(frame));
    EXPECT_EQ(frame.gray[0], value);
  }
  EXPECT_EQ(frame.index, 2u);
}

TEST(Camera, IsLostWhenUnplugged) {
  auto camera = std::make_unique<FakeCamera>();
  camera->unplugged_at = 2;
  auto source = start(std::move(camera));
  ASSERT_TRUE(source);
  Frame frame;
  ASSERT_TRUE(*(*source)->next(frame));
  ASSERT_TRUE(*(*source)->next(frame));
  EXPECT_EQ((*source)->next(frame).error().code, "camera.lost");
}

TEST(Camera, StopEndsAWaitThatWouldLast) {
  auto camera = std::make_unique<FakeCamera>();
  camera->frames = 0;
  CaptureFormat wish;
  wish.patience = std::chrono::seconds(60);
  auto source = start_camera(std::move(camera), "camera", wish);
  ASSERT_TRUE(source);
  std::thread stopper([&source] {
    std::this_thread::sleep_for(milliseconds(20));
    (*source)->stop();
  });
  Frame frame;
  const auto more = (*source)->next(frame);
  ASSERT_TRUE(more);
  EXPECT_FALSE(*more);
  stopper.join();
}

TEST(Camera, SaysWhyItCannotStart) {
  auto no_stream = std::make_unique<FakeCamera>();
  no_stream->capabilities = V4L2_CAP_VIDEO_CAPTURE;
  EXPECT_EQ(start(std::move(no_stream)).error().code, "camera.device");
  auto jpeg = std::make_unique<FakeCamera>();
  jpeg->format = V4L2_PIX_FMT_MJPEG;
  EXPECT_EQ(start(std::move(jpeg)).error().code, "camera.format");
  auto gaps = std::make_unique<FakeCamera>();
  gaps->row_bytes = 64;
  EXPECT_EQ(start(std::move(gaps)).error().code, "camera.format");
  auto busy = std::make_unique<FakeCamera>();
  busy->busy = true;
  EXPECT_EQ(start(std::move(busy)).error().code, "input.read");
  EXPECT_EQ(open_video_device("/dev/none").error().code, "input.open");
  EXPECT_EQ(*camera_number("camera"), 0);
  EXPECT_EQ(*camera_number("camera:3"), 3);
  EXPECT_FALSE(camera_number("camera:"));
  EXPECT_FALSE(camera_number("camera:-1"));
}

}  // namespace
}  // namespace modar
