// The frame's way through the render thread, and a progress bar.
#include "player.hpp"

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <string>

#include "frame_report.hpp"
#include "modar/pose_loop.hpp"
#include "pipeline.hpp"
#include "play.hpp"
#include "raw_source.hpp"
#include "taps.hpp"
#include "vision.hpp"

namespace modar {

Progress::Progress(bool wanted) : shown_(wanted && isatty(STDERR_FILENO) == 1) {}

void Progress::step(std::uint64_t frames, std::uint64_t total, std::uint64_t visible) {
  constexpr std::int64_t kEveryNs = 100'000'000;  // faster is not readable
  if (!shown_ || (now_ns() - last_ns_ < kEveryNs && frames != total)) return;
  last_ns_ = now_ns();
  std::string bar;
  if (total > 0) {
    constexpr std::uint64_t kCells = 30;
    const std::uint64_t full = std::min(kCells, kCells * frames / total);
    bar = "[" + std::string(full, '#') + std::string(kCells - full, '.') + "] ";
  }
  std::fprintf(stderr, "\r%sframe %llu", bar.c_str(), static_cast<unsigned long long>(frames));
  if (total > 0) std::fprintf(stderr, "/%llu", static_cast<unsigned long long>(total));
  std::fprintf(stderr, ", pattern seen in %llu\033[K", static_cast<unsigned long long>(visible));
}

void Progress::end() {
  if (shown_) std::fprintf(stderr, "\r\033[K");
}

namespace {

volatile std::sig_atomic_t interrupted = 0;

std::string file_name(const std::string& path) {
  const std::size_t end = path.find_last_not_of('/');
  if (end == std::string::npos) return path;
  const std::size_t slash = path.find_last_of('/', end);
  const std::size_t first = slash == std::string::npos ? 0 : slash + 1;
  return path.substr(first, end + 1 - first);
}

std::vector<std::string> pattern_names(const BundleView& bundle) {
  std::vector<std::string> names;
  for (const PatternRecord& pattern : bundle.patterns()) {
    names.emplace_back(bundle.name(pattern.name));
  }
  return names;
}

const std::string& input_of(const PlayOptions& options) {
  return options.golden.empty() ? options.input : options.golden;
}

/// Of its patterns only outlines can be drawn.
bool is_bare(const BundleView& bundle) {
  return bundle.scenes().empty() && bundle.nodes().empty();
}

}  // namespace

bool was_interrupted() {
  return interrupted != 0;
}

void catch_interrupts() {
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
}

Player::Player(const PlayOptions& options, const BundleView& bundle)
    : options_(options),
      bundle_(bundle),
      watch_(options.bundle),
      names_(pattern_names(bundle)),
      hysteresis_(names_.size()),
      smoother_(names_.size(), 0),
      controls_(bundle, options.outline || is_bare(bundle), options.osd || options.window),
      progress_(!options.quiet) {
  if (options.sound) controls_.apply({Act::kSound});
  reserve_items();
}

void Player::reserve_items() {
  copies_ = most_copies(bundle_, options_.copies);
  items_.reserve(copies_ * std::max(bundle_.scenes().size() + bundle_.nodes().size(),
                                    bundle_.patterns().size()));
}

Result<void> Player::open(const PlayerSetup& setup) {
  setup_ = setup;
  restart_scene();
  if (is_bare(bundle_) && !options_.quiet) {
    std::fputs("modar-play: no pattern of the bundle has content; outlines are drawn\n", stderr);
  }
  const bool kept = !options_.out.empty() || !options_.report.empty() || !options_.record.empty() ||
                    !options_.qos.empty() || !options_.golden.empty();
  if (!kept && !options_.window && !options_.json && !options_.quiet) {
    std::fputs("modar-play: no picture is kept; --out, --report or --window shows them\n", stderr);
  }
  MODAR_ASSIGN(auto screen, Screen::open(bundle_, options_));
  screen_ = std::move(screen);
  open_media();
  MODAR_TRY(open_sinks());
  return open_logs();
}

/// Nothing of the frames before shows any more.
void Player::restart_scene() {
  copies_ = most_copies(spot_ ? spot_->view : bundle_, options_.copies);
  hysteresis_ =
      Hysteresis(names_.size(), options_.method != "paper", setup_.source.stills, copies_);
  smoother_ = PoseSmoother(names_.size(), options_.smooth_ms, copies_);
}

/// Sound fits only frames that come at their own time.
void Player::open_media() {
  media_ = open_scene_media(bundle_, {setup_.source.live || options_.realtime, options_.sound});
}

Result<void> Player::open_sinks() {
  const auto add = [this](Result<std::unique_ptr<FrameSink>> opened) -> Result<void> {
    MODAR_ASSIGN(auto sink, std::move(opened));
    sinks_.push_back(std::move(sink));
    return {};
  };
  if (!options_.out.empty()) {
    MODAR_TRY(add(open_frame_sink(options_.out, setup_.source.fps)));
  }
  if (options_.report.empty()) return {};
  const ReportTitle title{file_name(options_.bundle), file_name(input_of(options_)),
                          options_.method, screen_->caps().renderer};
  return add(open_report(options_.report, setup_.source.fps, title, names_));
}

Result<void> Player::open_logs() {
  if (!options_.record.empty()) {
    MODAR_ASSIGN(auto recorder,
                 Recorder::create(options_.record,
                                  {options_.method, setup_.parameters, setup_.source.fps,
                                   bundle_.header().hash, setup_.camera, setup_.source.stills}));
    recorder_ = std::move(recorder);
  }
  if (options_.qos.empty()) return {};
  const GlCaps& caps = screen_->caps();
  MODAR_ASSIGN(
      QosLog log,
      QosLog::create(options_.qos,
                     {file_name(options_.bundle), file_name(input_of(options_)), options_.method,
                      setup_.parameters, caps.renderer, caps.version, options_.device}));
  qos_.emplace(std::move(log));
  return {};
}

Result<bool> Player::show(Job& job) {
  MODAR_TRY(screen_->resize(job.frame.width, job.frame.height));
  MODAR_TRY(follow_live(job));
  follow_spot(job);
  FrameReport report = begin_report(job);
  const std::int64_t before = now_ns();
  if (media_) MODAR_TRY(media_->show(*screen_));
  draw(job, report);
  const bool painted = screen_->has_window() && controls_.display();
  if (painted || !sinks_.empty()) screen_->picture();
  report.at(Stage::kRender) = ms_since(before);
  if (painted || !sinks_.empty()) {
    MODAR_TRY(paint(report));
  }
  if (painted) {
    screen_->present_canvas();
  } else {
    screen_->present();
  }
  // A file's frames wait for one another in the hand-off: that is no latency of anybody's.
  report.at(Stage::kLatency) = setup_.source.live || options_.realtime
                                   ? ms_since(job.frame.arrived_ns)
                                   : job.track_ms + ms_since(before);
  const std::int64_t shown = now_ns();
  MODAR_TRY(write_picture(report));
  report.at(Stage::kSink) = ms_since(shown);
  MODAR_TRY(write_line(report, job.frame));
  stats_.add(report);
  rate_.add(now_ns());
  progress_.step(stats_.frames(), setup_.source.frames, stats_.visible());
  MODAR_TRY(hold(job));
  stats_.set_uploads(screen_->uploads());
  std::swap(shown_, job.frame);
  return idle();
}

/// The vision thread looks for another pattern now: names and hysteresis follow.
void Player::follow_spot(const Job& job) {
  if (job.spot == spot_) return;
  spot_ = job.spot;
  names_ = pattern_names(spot_ ? spot_->view : bundle_);
  restart_scene();
}

/// The vision thread looks for the patterns of a newer version of the bundle: it is drawn from now
/// on. The view stays if the patterns are the same.
Result<void> Player::follow_live(const Job& job) {
  if (job.live == live_ || !job.live) return {};
  MODAR_TRY(screen_->load(job.live->view));
  live_ = job.live;
  bundle_ = live_->view;
  controls_.load(bundle_);
  open_media();
  const std::size_t copies = copies_;
  reserve_items();
  std::vector<std::string> names = pattern_names(bundle_);
  if (!spot_ && (names != names_ || copies != copies_)) {
    names_ = std::move(names);
    restart_scene();
  }
  if (!options_.quiet) {
    progress_.end();
    std::fprintf(stderr, "modar-play: the bundle was replaced, at frame %llu\n",
                 static_cast<unsigned long long>(job.frame.index));
  }
  return {};
}

/// Hysteresis, what to draw, and all of the report before drawing.
FrameReport Player::begin_report(const Job& job) {
  FrameReport report;
  report.frame = job.frame.index;
  report.time_s = job.frame.time_s;
  report.reduced = job.frame.reduced;
  for (const Detection& seen : job.track.visible) {
    if (spot_ || controls_.wants(seen.pattern)) report.visible.push_back(seen);
  }
  report.reason = job.track.reason;
  report.numbered = copies_ > 1;
  if (job.track.crowded >= 0) tell_of_copies(static_cast<std::size_t>(job.track.crowded));
  report.camera = {job.track.camera, setup_.camera.fx > 0};
  report.camera.focal.focal = job.camera.fx * job.frame.reduced;
  report.camera.focal.sigma *= job.frame.reduced;
  report.at(Stage::kRead) = job.frame.read_ms;
  report.at(Stage::kDetect) = job.track.times.detect;
  report.at(Stage::kDescribe) = job.track.times.describe;
  report.at(Stage::kMatch) = job.track.times.match;
  report.at(Stage::kHomography) = job.track.times.homography;
  report.at(Stage::kPose) = job.track.times.pose;
  report.at(Stage::kTrack) = job.track_ms;

  if (setup_.source.stills && job.frame.new_scene) restart_scene();
  drawn_.assign(report.visible.begin(), report.visible.end());
  report.at(Stage::kSmoothing) = smoother_.step(report.time_s, drawn_);
  const auto states = hysteresis_.step(drawn_);
  if (spot_) {
    controls_.collect_spot(states, items_);
  } else {
    collect(states, job, report);
  }
  for (const Hysteresis::State& state : states) {
    if (!state.shown) continue;
    if (state.measured) report.state = Shown::kShown;
    if (report.state == Shown::kHidden) report.state = Shown::kHeld;
  }
  return report;
}

/// Once a run: more copies of a pattern are in view than are tracked.
void Player::tell_of_copies(std::size_t pattern) {
  if (options_.quiet || std::exchange(told_of_copies_, true)) return;
  progress_.end();
  std::fprintf(
      stderr, "modar-play: more copies of '%s' are in view than are tracked; --copies N tracks N\n",
      pattern < names_.size() ? names_[pattern].c_str() : "");
}

/// The content of the patterns after the actions; clicks hit the previous drawing.
void Player::collect(std::span<const Hysteresis::State> states, const Job& job,
                     FrameReport& report) {
  events_.clear();
  for (const glm::dvec2 click : controls_.take_taps()) {
    const auto tap = tap_at(bundle_, job.camera, click, items_);
    if (tap) events_.push_back(*tap);
  }
  if (media_) media_->advance(report.time_s, events_);
  const auto commands = controls_.collect(states, report.time_s, events_, items_);
  if (!media_) return;
  report.scene = &media_->execute(commands, controls_);
  if (options_.quiet || report.scene->told.empty()) return;
  progress_.end();
  std::fputs(report.scene->told.c_str(), stderr);
}

/// A flat pattern's four corners, or the border of a curved one.
void Player::outline(const Canvas& canvas, const Camera& camera, const Detection& seen,
                     Colour colour) const {
  PatternSurface surface;
  const auto shape = spot_ ? std::span<const std::byte>()
                           : bundle_.section(SectionType::kPatternShape, seen.pattern);
  const bool flat = shape.empty() ||
                    view_pattern_shape(shape, bundle_.patterns()[seen.pattern].width,
                                       bundle_.patterns()[seen.pattern].height, surface) != nullptr;
  if (flat) return draw_outline(canvas, seen.corners, colour);
  draw_outline(canvas, surface, camera, seen.pose, colour);
}

/// Outlines are on the camera's picture, behind the models.
void Player::draw(const Job& job, const FrameReport& report) {
  constexpr Colour kOutline{64, 255, 96};
  constexpr Colour kExtended{255, 176, 32};
  if (!controls_.outline() || report.visible.empty()) {
    return screen_->draw(job.frame.picture(), job.camera, items_, shown_.picture());
  }
  screen_->draw(job.frame.picture(), job.camera, {}, shown_.picture());
  screen_->picture();
  const Canvas canvas = screen_->canvas();
  for (const Detection& seen : report.visible) {
    outline(canvas, job.camera, seen, seen.extended ? kExtended : kOutline);
  }
  screen_->draw_on_canvas(job.camera, items_);
}

Result<void> Player::paint(const FrameReport& report) {
  const Canvas canvas = screen_->canvas();
  if (!controls_.display()) return {};
  // A file's pictures are the same in each run, so no clock is painted on them.
  const bool clock = setup_.source.live || options_.realtime || options_.window;
  return draw_text_bar(canvas, display_text(report, names_, clock ? rate_.rate() : 0));
}

Result<void> Player::write_picture(const FrameReport& report) {
  const Canvas canvas = screen_->canvas();
  const RgbaView picture{canvas.rgba, canvas.width, canvas.height};
  for (const auto& sink : sinks_) MODAR_TRY(sink->picture(picture, report));
  return {};
}

Result<void> Player::write_line(const FrameReport& report, const Frame& frame) {
  if (golden_) golden_->add(report, names_);
  if (qos_) {
    MODAR_TRY(write_qos(report));
  }
  if (!options_.json && options_.report.empty() && !recorder_) return {};
  const std::string line = frame_line(report, names_, options_.homography);
  for (const auto& sink : sinks_) MODAR_TRY(sink->line(report, line));
  if (recorder_) {
    FrameReport recorded = report;
    recorded.reduced = 1;  // the recording has the reduced picture
    MODAR_TRY(recorder_->add(frame, frame_line(recorded, names_, options_.homography)));
  }
  return options_.json ? print_line(line) : Result<void>{};
}

Result<void> Player::write_qos(const FrameReport& report) {
  if (qos_->due(report)) {
    MemoryByKind memory = measure_memory(bundle_.bytes());
    memory.gpu_geometry = screen_->gpu_memory().geometry;
    memory.gpu_textures = screen_->gpu_memory().textures;
    memory.gpu_batches = screen_->gpu_memory().batches;
    MODAR_TRY(qos_->window(memory));
  }
  return qos_->add(report, names_);
}

void Player::take_acts(std::chrono::milliseconds limit) {
  for (const UserAct& act : screen_->acts(limit)) controls_.apply(act);
}

bool Player::idle() {
  if (setup_.live != nullptr) {
    auto newer = watch_.look();
    if (!newer) std::fprintf(stderr, "modar-play: %s\n", to_line(newer.error()).c_str());
    if (newer && *newer) setup_.live->put(std::move(*newer));
  }
  take_acts(std::chrono::milliseconds(0));
  return !was_interrupted() && !controls_.quit();
}

/// Stays with one frame while the user pauses or clicks corners; the window answers meanwhile.
Result<void> Player::hold(const Job& job) {
  constexpr std::chrono::milliseconds kLook(20);
  if (!controls_.holds()) return {};
  if (media_) media_->hold(true);
  while (controls_.holds() && !controls_.quit() && !was_interrupted()) {
    if (controls_.frozen()) {
      MODAR_TRY(show_frozen(job));
    }
    take_acts(kLook);
    std::array<glm::dvec2, 4> corners{};
    if (controls_.take_corners(corners)) make_pattern(job, corners);
  }
  if (media_) media_->hold(false);
  return {};
}

/// The camera's picture without models, and the corners that were clicked so far.
Result<void> Player::show_frozen(const Job& job) {
  constexpr Colour kMark{255, 208, 64};
  constexpr double kArm = 9;
  screen_->draw(job.frame.picture(), job.camera, {});
  screen_->picture();
  const Canvas canvas = screen_->canvas();
  for (const glm::dvec2 corner : controls_.corners()) {
    draw_line(canvas, corner - glm::dvec2(kArm, 0), corner + glm::dvec2(kArm, 0), 2, kMark);
    draw_line(canvas, corner - glm::dvec2(0, kArm), corner + glm::dvec2(0, kArm), 2, kMark);
  }
  const std::size_t left = 4 - controls_.corners().size();
  auto done = draw_text_bar(canvas, "click the corners of a new pattern: " + std::to_string(left) +
                                        " left (Escape: never mind)");
  screen_->present_canvas();
  return done;
}

/// An error is printed and ends nothing: the user may click again.
void Player::make_pattern(const Job& job, const std::array<glm::dvec2, 4>& corners) {
  Frame frame = job.frame;
  make_rgb(frame);
  auto pattern =
      make_spot_pattern(frame.rgb_image(), corners, parameter_set(bundle_, setup_.parameter_set));
  if (!pattern) {
    std::fprintf(stderr, "modar-play: %s\n", to_line(pattern.error()).c_str());
    return;
  }
  if (setup_.spot != nullptr) setup_.spot->put(std::move(*pattern));
}

Result<int> Player::finish(const PipelineCounts& counts) {
  progress_.end();
  const bool interrupted = was_interrupted() && !setup_.source.live;
  if (interrupted && stats_.frames() == 0) {
    return fail(ExitCode::kIo, "play.interrupted", input_of(options_),
                "the run was interrupted before its first frame", "start it again");
  }
  stats_.set_dropped(counts.dropped);
  stats_.set_skipped(counts.skipped.size());
  for (const Error& error : counts.skipped) {
    std::fprintf(stderr, "modar-play: skipped: %s\n", to_line(error).c_str());
  }
  MODAR_TRY(finish_outputs(!interrupted));
  if (interrupted) {
    return fail(ExitCode::kIo, "play.interrupted", input_of(options_),
                "the run was interrupted after frame " + std::to_string(stats_.frames()),
                "the output is complete for these frames; run it again for all of them");
  }
  return golden_ && !golden_->good() ? kExitDifferent : 0;
}

/// Completes every output. whole: all frames were played, so that a comparison has a verdict.
Result<void> Player::finish_outputs(bool whole) {
  const std::string summary = summary_line(stats_);
  for (const auto& sink : sinks_) MODAR_TRY(sink->finish(summary));
  if (recorder_) {
    MODAR_TRY(recorder_->finish());
  }
  if (qos_) {
    MODAR_TRY(qos_->finish(summary));
  }
  if (golden_ && whole) {
    MODAR_TRY(print_line(golden_->line()));
  }
  if (options_.json || !options_.quiet) {
    MODAR_TRY(print_line(options_.json ? summary : summary_text()));
  }
  return {};
}

std::string Player::summary_text() const {
  const StageTimes ms = stats_.median_ms();
  const std::string skipped =
      stats_.skipped() == 0 ? "" : "; skipped: " + std::to_string(stats_.skipped());
  char text[200];
  std::snprintf(
      text, sizeof text,
      "%llu %s, a pattern seen in %llu (%.1f %%), held in %llu; median ms: track "
      "%.1f, render %.1f%s%s",
      static_cast<unsigned long long>(stats_.frames()), stats_.frames() == 1 ? "frame" : "frames",
      static_cast<unsigned long long>(stats_.visible()), stats_.recognised_percent(),
      static_cast<unsigned long long>(stats_.count(Shown::kHeld)),
      ms[static_cast<std::size_t>(Stage::kTrack)], ms[static_cast<std::size_t>(Stage::kRender)],
      draws_in_software(screen_->caps().renderer) ? " (in software)" : "", skipped.c_str());
  return text;
}

}  // namespace modar
