// A camera through Video4Linux2, the newest frame first.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "frame_source.hpp"
#include "pipeline.hpp"

namespace modar {

/// The four calls that the source needs of a device node; a test provides its own camera.
class VideoDevice {
 public:
  VideoDevice() = default;
  VideoDevice(const VideoDevice&) = delete;
  VideoDevice& operator=(const VideoDevice&) = delete;
  virtual ~VideoDevice() = default;

  /// 0, or the errno of a VIDIOC_* request.
  virtual int control(unsigned long request, void* argument) = 0;
  /// The buffer at that offset; empty where it cannot be mapped. The device unmaps it at its end.
  virtual std::span<const std::uint8_t> map(std::size_t length, std::uint32_t offset) = 0;
  /// Waits for a frame.
  virtual WakeEvent::Event wait(const WakeEvent& wake, std::chrono::milliseconds limit) = 0;
};

/// /dev/videoN. Errors: kIo "input.open".
Result<std::unique_ptr<VideoDevice>> open_video_device(const std::string& path);

struct CaptureFormat {
  int width = 1280;  ///< the device answers with the nearest that it has
  int height = 720;
  double fps = 30;
  std::chrono::milliseconds patience{3000};  ///< without a frame for so long, the camera is lost
};

/// Sets the device up and starts it.
/// Errors: kUnsupported "camera.device" (no camera that streams), "camera.format" (it offers none
/// of YUYV, NV12, NV21, I420, gray), kIo "input.read"; later from next(): kIo "camera.lost" where
/// it is unplugged or falls silent.
Result<std::unique_ptr<FrameSource>> start_camera(std::unique_ptr<VideoDevice> device,
                                                  const std::string& name,
                                                  const CaptureFormat& requested);

/// The number behind "camera" or "camera:N". Errors: kUsage "input.camera".
Result<int> camera_number(const std::string& input);

}  // namespace modar
