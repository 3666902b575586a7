// What the player knows about a frame once it is on the screen: the content of its JSON line.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "modar/tracker.hpp"

namespace modar {

enum class Stage : std::uint8_t {
  kRead,
  kDetect,
  kDescribe,
  kMatch,
  kHomography,
  kPose,
  kTrack,      ///< the whole of the vision thread's work
  kRender,     ///< draw calls and reading the picture back
  kSink,       ///< writing pictures
  kSmoothing,  ///< no time that was spent: how far smoothed poses lag
  kLatency,    ///< from the complete frame to its picture; of files: vision and rendering
};
inline constexpr std::array<const char*, 11> kStageNames = {
    "read",  "detect", "describe", "match",     "homography", "pose",
    "track", "render", "sink",     "smoothing", "latency"};
using StageTimes = std::array<double, kStageNames.size()>;  ///< milliseconds

enum class Shown : std::uint8_t {
  kShown,   ///< a model is drawn at a pose that was measured in this frame
  kHeld,    ///< hysteresis keeps a model at its last pose
  kHidden,  ///< no model is drawn
};
const char* to_string(Shown state);

struct FrameReport {
  std::uint64_t frame = 0;
  double time_s = 0;
  std::vector<Detection> visible;  ///< measured in this frame, whether shown or not
  Reason reason = Reason::kNoFeatures;
  Shown state = Shown::kHidden;
  StageTimes ms{};

  double& at(Stage stage) { return ms[static_cast<std::size_t>(stage)]; }
  [[nodiscard]] double at(Stage stage) const { return ms[static_cast<std::size_t>(stage)]; }
};

}  // namespace modar
