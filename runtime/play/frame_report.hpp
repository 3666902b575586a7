// What the player knows about each frame, and what it writes of it: the statistics of a run, the
// JSON lines (their keys are a contract, see --json) and the log of a field trial.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/atomic_file.hpp"
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

/// The camera by which a frame was measured.
struct CameraReport {
  CameraEstimate focal;
  bool given = false;  ///< by somebody; else estimated or, by the ModAR paper's method, assumed
};

/// Requests of the bundle's actions in one frame, and the sound in it.
struct SceneState {
  /// "play NODE", "pause NODE", "text NODE" or "link ADDRESS", as the actions asked for it.
  std::vector<std::string> commands;
  std::string
      caption;  ///< the spoken captions, in one language; lines end with a line feed but the last
  std::string told;  ///< lines for the user: labels' words, addresses, captions that begin
};

struct FrameReport {
  std::uint64_t frame = 0;
  double time_s = 0;
  double reduced = 1;              ///< Frame::reduced
  std::vector<Detection> visible;  ///< measured in this frame, whether shown or not
  bool numbered = false;           ///< several copies of a pattern are tracked
  Reason reason = Reason::kNoFeatures;
  Shown state = Shown::kHidden;
  CameraReport camera;  ///< in pixels of the file
  StageTimes ms{};
  const SceneState* scene = nullptr;  ///< of the frame; null: nothing acts

  double& at(Stage stage) { return ms[static_cast<std::size_t>(stage)]; }
  [[nodiscard]] double at(Stage stage) const { return ms[static_cast<std::size_t>(stage)]; }
};

inline constexpr std::array<Reason, 15> kReasons = {Reason::kVisible,
                                                    Reason::kNoFeatures,
                                                    Reason::kFewMatches,
                                                    Reason::kNoGeometry,
                                                    Reason::kFailedVerification,
                                                    Reason::kLostByBlur,
                                                    Reason::kOutOfView,
                                                    Reason::kOtherPrint,
                                                    Reason::kCurved,
                                                    Reason::kTooSmall,
                                                    Reason::kTooDark,
                                                    Reason::kBlurred,
                                                    Reason::kOverexposed,
                                                    Reason::kGlare,
                                                    Reason::kAtTheEdge};

/// A frame whose picture comes later than this after the frame itself is late (30 frames a second).
inline constexpr double kFrameBudgetMs = 1000.0 / 30.0;

/// Bytes of pictures on their way to GL.
struct UploadCounts {
  std::uint64_t bytes = 0;
  std::uint64_t same = 0;  ///< not uploaded: GL has them from the picture before
};

class RunStats {
 public:
  void add(const FrameReport& report);
  void set_dropped(std::uint64_t dropped) { dropped_ = dropped; }
  void set_skipped(std::uint64_t skipped) { skipped_ = skipped; }
  void set_uploads(const UploadCounts& uploads) { uploads_ = uploads; }

  [[nodiscard]] std::uint64_t frames() const { return times_.size(); }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  [[nodiscard]] const UploadCounts& uploads() const { return uploads_; }
  /// Pictures that cannot be read.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }
  [[nodiscard]] std::uint64_t visible() const { return visible_; }  ///< frames with a detection
  [[nodiscard]] std::uint64_t late() const { return late_; }
  [[nodiscard]] std::uint64_t count(Shown state) const {
    return states_[static_cast<std::size_t>(state)];
  }
  [[nodiscard]] std::uint64_t count(Reason reason) const {
    return reasons_[static_cast<std::size_t>(reason)];
  }
  [[nodiscard]] double recognised_percent() const;
  /// Of the last frame; none without frames.
  [[nodiscard]] const std::optional<CameraReport>& camera() const { return camera_; }
  /// Lower median of each stage; 0 without frames.
  [[nodiscard]] StageTimes median_ms() const { return quantile_ms(0.5); }
  /// The value that so large a share of the frames does not exceed, rounded down to a frame's own.
  /// share: 0 to 1.
  [[nodiscard]] StageTimes quantile_ms(double share) const;

 private:
  std::vector<std::array<float, kStageNames.size()>> times_;
  std::array<std::uint64_t, 3> states_{};
  std::array<std::uint64_t, kReasons.size()> reasons_{};
  std::uint64_t visible_ = 0;
  std::uint64_t late_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint64_t skipped_ = 0;
  UploadCounts uploads_;
  std::optional<CameraReport> camera_;
};

/// True for drivers of OpenGL that draw on the processor, by the name that they give themselves:
/// Mesa's llvmpipe, softpipe and swrast, SwiftShader.
bool draws_in_software(std::string_view gl_renderer);

/// {frame,time_s,visible:[{pattern,corners,rotation,translation,inliers,matches,fit,agreeing,
/// likeness}],reason,state,camera:{focal_px,sigma_px,source},ms}; sigma_px of an estimated camera;
/// commands where the bundle's actions ask for some, caption where something is heard;
/// copy where several of a pattern are tracked; of an extended pose also extended, position_sigma,
/// rotation_sigma. Rotation row by row; numbers that are not finite become null. No newline at the
/// end. pattern_names: by the bundle's pattern index. homographies: adds each pattern's
/// `homography`, row by row, from its unit square (0, 0 its top left corner, 1, 1 its bottom right
/// one) to the frame's pixels; null where its corners have none. Corners and homographies are in
/// pixels of the file.
std::string frame_line(const FrameReport& report, std::span<const std::string> pattern_names,
                       bool homographies = false);

/// {"summary":{frames,dropped,skipped,visible,recognised_percent,states,reasons,late,camera,ms}};
/// ms: medians, camera: of the last frame.
std::string summary_line(const RunStats& stats);

/// {frame,model,clip,angle_deg,triangles,draw_calls,ms:{render}}: a picture of the turntable. clip:
/// of a model that has some. `pattern` in place of `model` in a bundle of pictures and videos
/// alone.
struct TurntableReport {
  std::uint64_t frame = 0;
  std::string_view name;
  std::string_view clip;
  bool pattern = false;
  double angle_deg = 0;
  std::uint64_t triangles = 0;
  int draw_calls = 0;
  double render_ms = 0;
};
std::string turntable_line(const TurntableReport& report);

/// Bytes by kind.
struct MemoryByKind {
  std::uint64_t resident = 0;         ///< of the process
  std::uint64_t heap = 0;             ///< allocated and not freed; 0 where libc does not tell
  std::uint64_t bundle = 0;           ///< mapped
  std::uint64_t bundle_resident = 0;  ///< of those, pages in memory
  std::uint64_t gpu_geometry = 0;
  std::uint64_t gpu_textures = 0;
  std::uint64_t gpu_batches = 0;
};

/// Measures what the operating system reports; the GPU's part stays 0. mapped: the bundle's bytes.
MemoryByKind measure_memory(std::span<const std::byte> mapped);

/// What the log says about the machine and the run, once.
struct QosHead {
  std::string bundle;
  std::string input;
  std::string method;
  std::string parameters;
  std::string gl_renderer;
  std::string gl_version;
  std::string device;  ///< profile that masks the context
};

/// JSON lines: {"qos":{...head}}, {"event":"found"|"lost",...} as they happen, {"second":{...}}
/// once a second (or 30 frames, where frames are not live), {"summary":{...}}.
class QosLog {
 public:
  /// every_s: seconds of a window by the frames' own clock. Errors: kIo.
  static Result<QosLog> create(const std::string& path, const QosHead& head, double every_s = 1);

  /// True where this frame completes a window: then call window() with the memory unchanged.
  [[nodiscard]] bool due(const FrameReport& report) const;
  Result<void> add(const FrameReport& report, std::span<const std::string> pattern_names);
  Result<void> window(const MemoryByKind& memory);
  Result<void> finish(std::string_view summary);

 private:
  QosLog(AtomicFile file, double every_s) : file_(std::move(file)), every_s_(every_s) {}
  Result<void> write(std::string_view line);

  AtomicFile file_;
  double every_s_;
  double window_start_s_ = 0;
  double last_s_ = 0;
  RunStats window_;
  std::vector<bool> seen_;       ///< by pattern, in the frame before
  std::vector<double> since_s_;  ///< when it was found or lost
};

}  // namespace modar
