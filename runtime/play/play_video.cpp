// Plays a bundle over frames: the render thread's step, and what it prints.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <limits>
#include <vector>

#include "camera_file.hpp"
#include "frame_sink.hpp"
#include "frame_source.hpp"
#include "json_lines.hpp"
#include "pipeline.hpp"
#include "play.hpp"
#include "progress.hpp"
#include "run_stats.hpp"
#include "screen.hpp"
#include "vision.hpp"

namespace modar {
namespace {

volatile std::sig_atomic_t interrupted = 0;

std::string file_name(const std::string& path) {
  const std::size_t end = path.find_last_not_of('/');
  const std::size_t slash = path.find_last_of('/', end);
  const std::size_t first = slash == std::string::npos ? 0 : slash + 1;
  return end == std::string::npos ? path : path.substr(first, end + 1 - first);
}

std::vector<std::string> pattern_names(const BundleView& bundle) {
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < bundle.patterns().size(); ++i) {
    names.emplace_back(bundle.name(bundle.patterns()[i].name));
  }
  return names;
}

/// One a run; show() is the render thread's step.
class Player {
 public:
  Player(const PlayOptions& options, const BundleView& bundle)
      : options_(options),
        bundle_(bundle),
        names_(pattern_names(bundle)),
        hysteresis_(names_.size()),
        progress_(!options.quiet) {
    items_.reserve(bundle.scenes().size());
  }

  Result<void> open(const SourceInfo& source) {
    source_ = source;
    auto screen = Screen::open(bundle_, options_);
    if (!screen) return tl::unexpected(screen.error());
    screen_ = std::move(*screen);
    if (!options_.out.empty()) {
      if (auto added = add(open_frame_sink(options_.out, source.fps)); !added) return added;
    }
    if (!options_.report.empty()) {
      const ReportTitle title{file_name(options_.bundle), file_name(options_.input),
                              options_.method};
      if (auto added = add(open_report(options_.report, source.fps, title, names_)); !added) {
        return added;
      }
    }
    return {};
  }

  Result<bool> show(const Job& job) {
    if (auto sized = screen_->resize(job.frame.width, job.frame.height); !sized) {
      return tl::unexpected(sized.error());
    }
    FrameReport report = begin_report(job);
    const std::int64_t before = now_ns();
    screen_->draw(job.frame.rgb_image(), job.camera, items_);
    if (!sinks_.empty()) screen_->picture();
    report.at(Stage::kRender) = ms_since(before);
    report.at(Stage::kLatency) = ms_since(job.frame.arrived_ns);
    if (auto written = write_picture(report); !written) return tl::unexpected(written.error());
    report.at(Stage::kSink) = ms_since(before) - report.at(Stage::kRender);
    if (auto written = write_line(report); !written) return tl::unexpected(written.error());
    stats_.add(report);
    progress_.step(stats_.frames(), source_.frames, stats_.visible());
    return go_on();
  }

  bool go_on() { return interrupted == 0 && screen_->poll(); }

  Result<void> finish(const PipelineCounts& counts) {
    progress_.end();
    if (interrupted != 0 && !source_.live) {
      return fail(ExitCode::kIo, "play.interrupted", "", "the run was interrupted",
                  "nothing half-made was left; start it again");
    }
    stats_.set_dropped(counts.dropped);
    const std::string summary = summary_line(stats_);
    for (const auto& sink : sinks_) {
      if (auto finished = sink->finish(summary); !finished) return finished;
    }
    if (options_.json) return print_line(summary);
    return options_.quiet ? Result<void>{} : print_line(summary_text());
  }

 private:
  Result<void> add(Result<std::unique_ptr<FrameSink>> sink) {
    if (!sink) return tl::unexpected(sink.error());
    sinks_.push_back(std::move(*sink));
    return {};
  }

  /// Hysteresis, what to draw, and all of the report that stands before drawing.
  FrameReport begin_report(const Job& job) {
    FrameReport report;
    report.frame = job.frame.index;
    report.time_s = job.frame.time_s;
    report.visible = job.track.visible;
    report.reason = job.track.reason;
    report.at(Stage::kRead) = job.frame.read_ms;
    report.at(Stage::kDetect) = job.track.times.detect;
    report.at(Stage::kDescribe) = job.track.times.describe;
    report.at(Stage::kMatch) = job.track.times.match;
    report.at(Stage::kHomography) = job.track.times.homography;
    report.at(Stage::kPose) = job.track.times.pose;
    report.at(Stage::kTrack) = job.track_ms;

    items_.clear();
    const auto states = hysteresis_.step(report.visible);
    for (std::uint32_t i = 0; i < bundle_.scenes().size(); ++i) {
      const SceneRecord& scene = bundle_.scenes()[i];
      const Hysteresis::State& state = states[scene.pattern];
      if (state.shown) items_.push_back({scene.model, gl_view(state.pose) * scene_matrix(scene)});
    }
    for (const Hysteresis::State& state : states) {
      if (!state.shown) continue;
      if (state.measured) report.state = Shown::kShown;
      if (report.state == Shown::kHidden) report.state = Shown::kHeld;
    }
    return report;
  }

  Result<void> write_picture(const FrameReport& report) {
    if (sinks_.empty()) return {};
    const Canvas canvas = screen_->canvas();
    if (options_.outline) {
      constexpr Colour kOutline{64, 255, 96};
      for (const Sighting& seen : report.visible) draw_outline(canvas, seen.corners, kOutline);
    }
    const RgbaImage picture{canvas.rgba, canvas.width, canvas.height};
    for (const auto& sink : sinks_) {
      if (auto written = sink->picture(picture, report); !written) return written;
    }
    return {};
  }

  Result<void> write_line(const FrameReport& report) {
    if (!options_.json && options_.report.empty()) return {};
    const std::string line = frame_line(report, names_);
    for (const auto& sink : sinks_) {
      if (auto written = sink->line(report, line); !written) return written;
    }
    return options_.json ? print_line(line) : Result<void>{};
  }

  [[nodiscard]] std::string summary_text() const {
    char text[200];
    std::snprintf(text, sizeof text,
                  "%llu frames, a pattern seen in %llu (%.1f %%), held in %llu; median ms: track "
                  "%.1f, render %.1f",
                  static_cast<unsigned long long>(stats_.frames()),
                  static_cast<unsigned long long>(stats_.visible()), stats_.recognised_percent(),
                  static_cast<unsigned long long>(stats_.count(Shown::kHeld)),
                  stats_.median_ms()[static_cast<std::size_t>(Stage::kTrack)],
                  stats_.median_ms()[static_cast<std::size_t>(Stage::kRender)]);
    return text;
  }

  const PlayOptions& options_;
  const BundleView& bundle_;
  const std::vector<std::string> names_;
  Hysteresis hysteresis_;
  Progress progress_;
  SourceInfo source_;
  std::unique_ptr<Screen> screen_;
  std::vector<std::unique_ptr<FrameSink>> sinks_;
  std::vector<DrawItem> items_;
  RunStats stats_;
};

Result<TrackStep> open_tracker(const PlayOptions& options, const BundleView& bundle) {
  VisionOptions vision;
  if (!options.camera_file.empty()) {
    Result<Camera> camera = read_camera_file(options.camera_file);
    if (!camera) return tl::unexpected(camera.error());
    vision.camera = *camera;
  }
  const Result<std::uint32_t> set = choose_parameter_set(bundle, options.parameters);
  if (!set) return tl::unexpected(set.error());
  vision.parameter_set = *set;
  return open_vision(bundle, vision);
}

}  // namespace

Result<void> play_video(const PlayOptions& options, const BundleView& bundle) {
  Result<TrackStep> track = open_tracker(options, bundle);
  if (!track) return tl::unexpected(track.error());
  auto source = open_frame_source(options.input);
  if (!source) return tl::unexpected(source.error());
  const SourceInfo info = (*source)->info();
  Player player(options, bundle);
  if (auto opened = player.open(info); !opened) return opened;
  if (bundle.scenes().empty() && !options.quiet) {
    std::fprintf(stderr, "modar-play: no scene of the bundle binds a model to a pattern\n");
  }

  PipelineOptions how;
  how.paced = options.realtime && !info.live;
  if (info.live || options.realtime) how.delivery = Delivery::kNewest;
  how.idle = [&player] { return player.go_on(); };
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  const Result<PipelineCounts> counts = run_pipeline(
      **source, *track, [&player](const Job& job) { return player.show(job); }, how);
  if (!counts) return tl::unexpected(counts.error());
  return player.finish(*counts);
}

}  // namespace modar
