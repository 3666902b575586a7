// The render thread's step of a run: draws each frame and hands it to whatever wants it.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controls.hpp"
#include "frame_report.hpp"
#include "frame_sink.hpp"
#include "frame_source.hpp"
#include "live_bundle.hpp"
#include "modar/pose_smoother.hpp"
#include "overlay.hpp"
#include "pipeline.hpp"
#include "recording.hpp"
#include "scene_media.hpp"
#include "screen.hpp"
#include "spot_pattern.hpp"

namespace modar {

class Progress {
 public:
  /// Prints nothing unless `wanted` and standard error is a terminal.
  explicit Progress(bool wanted);
  /// total: 0 where it is unknown.
  void step(std::uint64_t frames, std::uint64_t total, std::uint64_t visible);
  /// Clears the bar's line.
  void end();

 private:
  bool shown_ = false;
  std::int64_t last_ns_ = 0;
};

/// Inputs of a run, apart from its options.
struct PlayerSetup {
  SourceInfo source;
  std::uint32_t parameter_set = 0;  ///< id
  std::string parameters;           ///< its name
  Camera camera;                    ///< calibrated; width 0: the default for each frame
  SpotSlot* spot = nullptr;         ///< where patterns made on the spot go
  LiveSlot* live = nullptr;  ///< where newer versions of the bundle go; null: none is looked for
};

class Player {
 public:
  /// The options and the bundle's bytes outlive it.
  Player(const PlayOptions& options, const BundleView& bundle);

  /// Opens screen, sinks and logs on this thread.
  Result<void> open(const PlayerSetup& setup);
  /// Compares each frame with this recording.
  void compare(GoldenCheck golden) { golden_ = std::move(golden); }

  /// Shows one frame, and leaves an older one in the job. Answers false once the user ended the
  /// run.
  Result<bool> show(Job& job);
  /// Takes what the user did. Answers false once the user ended the run.
  bool idle();
  /// Completes every output; answers the program's exit code.
  /// Of an interrupted run, the frames that were played. Errors: kIo "play.interrupted" (a file's
  /// run, after its outputs are complete), those of the outputs.
  Result<int> finish(const PipelineCounts& counts);

 private:
  Result<void> finish_outputs(bool whole);
  Result<void> open_sinks();
  Result<void> open_logs();
  FrameReport begin_report(const Job& job);
  void follow_spot(const Job& job);
  void collect(std::span<const Hysteresis::State> states, const Job& job, FrameReport& report);
  void open_media();
  void restart_scene();
  void reserve_items();
  void tell_of_copies(std::size_t pattern);
  void outline(const Canvas& canvas, const Camera& camera, const Detection& seen,
               Colour colour) const;
  void draw(const Job& job, const FrameReport& report);
  Result<void> follow_live(const Job& job);
  Result<void> paint(const FrameReport& report);
  Result<void> write_picture(const FrameReport& report);
  Result<void> write_line(const FrameReport& report, const Frame& frame);
  Result<void> write_qos(const FrameReport& report);
  void take_acts(std::chrono::milliseconds limit);
  Result<void> hold(const Job& job);
  Result<void> show_frozen(const Job& job);
  void make_pattern(const Job& job, const std::array<glm::dvec2, 4>& corners);
  [[nodiscard]] std::string summary_text() const;

  const PlayOptions& options_;
  BundleView bundle_;
  BundleWatch watch_;
  std::shared_ptr<const LiveBundle> live_;  ///< holds the bytes of bundle_ where it is a newer one
  PlayerSetup setup_;
  std::vector<std::string> names_;  ///< of the patterns that are looked for
  Hysteresis hysteresis_;
  PoseSmoother smoother_;
  std::vector<Detection> drawn_;  ///< detections, at smoothed poses
  Controls controls_;
  std::vector<SceneEvent> events_;  ///< taps, and what ended
  Progress progress_;
  RateMeter rate_;
  RunStats stats_;
  std::unique_ptr<Screen> screen_;
  Frame shown_;                        ///< the frame before
  std::unique_ptr<SceneMedia> media_;  ///< null: the bundle has none, or this build plays none
  std::vector<std::unique_ptr<FrameSink>> sinks_;
  std::unique_ptr<Recorder> recorder_;
  std::optional<GoldenCheck> golden_;
  std::optional<QosLog> qos_;
  std::vector<DrawItem> items_;
  std::size_t copies_ = 1;  ///< most of a pattern that are tracked
  bool told_of_copies_ = false;
  std::shared_ptr<const SpotPattern> spot_;  ///< the one that names_ and hysteresis_ are about
};

/// True once the user asked for the end by Ctrl-C or a signal.
bool was_interrupted();
void catch_interrupts();

}  // namespace modar
