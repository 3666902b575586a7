// `modar-lab bench render BUNDLE --video FILE`: the ModAR paper's Table 9 compared with a run of
// the player.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/extensions/lab/heap.hpp"
#include "bake/process/process.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"
#include "modar/pose_loop.hpp"

namespace modar {
namespace {

constexpr int kPlayedRuns = 3;  ///< whose mean is stated, as the paper's is

/// What the ModAR paper prints of one model on one device; its dashes are no stutters.
struct PaperSession {
  double recognition_fps;
  double loading_fps;
  double display_fps;
  double loading_s;
  double display_s;
  double stutters;
};
struct PaperModel {
  const char* name;
  PaperSession low_end;
  PaperSession mid_range;
};
constexpr PaperModel kPaperModels[] = {
    {"pottery", {25, 18, 17, 17, 18, 0}, {30, 24, 23, 12, 12, 0}},
    {"bust", {26, 12, 10, 28, 30, 3}, {29, 24, 20, 25, 27, 1}},
    {"statue", {28, 22, 22, 26, 28, 2}, {30, 25, 25, 17, 17, 0}},
    {"church", {28, 9, 8, 58, 61, 3}, {30, 15, 13, 51, 54, 1}}};
constexpr PaperSession kNoSession = {kNoFigure, kNoFigure, kNoFigure,
                                     kNoFigure, kNoFigure, kNoFigure};

/// Frames a second that vision keeps up with while the pattern is seen, at most the source's own.
double recognition_fps(const std::vector<PlayedFrame>& frames) {
  double ms = 0;
  double count = 0;
  for (const PlayedFrame& frame : frames) {
    if (!frame.recognised) continue;
    ms += frame.track_ms;
    ++count;
  }
  if (frames.empty() || count == 0) return kNoFigure;
  const auto steps = static_cast<double>(frames.back().frame - frames.front().frame);
  const double source = ratio(steps, frames.back().time_s - frames.front().time_s);
  const double able = ms > 0 ? 1e3 * count / ms : std::numeric_limits<double>::infinity();
  return std::fmin(source, able);
}

/// Pictures a second of the video, over neighbours that both show a model: frames dropped between
/// them lower it.
double display_fps(const std::vector<PlayedFrame>& frames) {
  double seconds = 0;
  double count = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (!frames[i - 1].drawn || !frames[i].drawn) continue;
    seconds += frames[i].time_s - frames[i - 1].time_s;
    ++count;
  }
  return ratio(count, seconds);
}

/// From the first frame in which the pattern is seen to the first picture with its model, where the
/// paper's prototype loads the model: frames of the video a second, and seconds.
struct Loading {
  double fps = kNoFigure;
  double seconds = kNoFigure;
};
Loading loading(const std::vector<PlayedFrame>& frames) {
  const auto seen = std::ranges::find(frames, true, &PlayedFrame::recognised);
  const auto drawn =
      std::find_if(seen, frames.end(), [](const auto& frame) { return frame.drawn; });
  if (drawn == frames.end()) return {};
  const double between = drawn->time_s - seen->time_s;
  return {ratio(static_cast<double>(drawn - seen), between), between + drawn->latency_ms / 1e3};
}

/// Seconds from the camera's frame to the first picture with a model.
double display_s(const std::vector<PlayedFrame>& frames) {
  const auto first = std::ranges::find(frames, true, &PlayedFrame::drawn);
  return first == frames.end() ? kNoFigure : first->latency_ms / 1e3;
}

/// Plays at the video's own speed in a process of its own, without a window.
Result<PlayedRun> play(const std::string& bundle, const BenchOptions& command) {
  const TemporaryFolder folder;
  const std::string output = folder.path() + "/lines";
  std::vector<std::string> words = {program_folder() + "/modar-play",
                                    bundle,
                                    "--input",
                                    command.pose.video,
                                    "--realtime",
                                    "--json"};
  if (!command.device.empty()) words.insert(words.end(), {"--device", command.device});
  if (command.pose.quiet || command.json) words.emplace_back("--quiet");
  const ProcessOutcome outcome = run_measured({words, {}, output});
  if (folder.path().empty() || outcome.exit != 0) {
    return fail(ExitCode::kIo, "bench.play", words[0],
                "it could not play the video, exit code " + std::to_string(outcome.exit),
                "look at what it says, or play the same bundle and video with it");
  }
  std::ifstream file(output);
  MODAR_ASSIGN(PlayedRun run, read_played_run({std::istreambuf_iterator<char>(file), {}}));
  run.cpu_percent = ratio(100 * outcome.cpu_seconds, outcome.wall_seconds);
  return run;
}

/// The mean of each row over the runs, of those in which it could be told.
std::vector<BenchRow> mean_rows(const std::vector<std::vector<BenchRow>>& runs) {
  std::vector<BenchRow> rows = runs[0];
  for (std::size_t i = 0; i < rows.size(); ++i) {
    double sum = 0;
    double count = 0;
    for (const auto& run : runs) {
      if (std::isnan(run[i].ours)) continue;
      sum += run[i].ours;
      ++count;
    }
    rows[i].ours = ratio(sum, count);
    rows[i].ratio = ratio(rows[i].ours, rows[i].reference);
  }
  return rows;
}

/// The heap of the tracker's classes: after they are made, and after a frame was searched.
Result<void> add_heap(const std::string& path, const std::string& model,
                      std::vector<BenchRow>& rows) {
  MODAR_ASSIGN(const MappedFile file, MappedFile::open(path));
  const double before = heap_bytes();
  MODAR_ASSIGN(const BundleView bundle, BundleView::open(file.bytes()));
  const double opened = heap_bytes();
  constexpr int kWidth = 640;
  constexpr int kHeight = 480;
  MODAR_ASSIGN(const auto loop, PoseLoop::create(bundle, default_camera(kWidth, kHeight)));
  const double made = heap_bytes();
  const std::vector<std::uint8_t> frame(std::size_t{kWidth} * kHeight, 128);
  MODAR_TRY(loop->step({frame.data(), kWidth, kHeight, kWidth}));
  const auto add = [&](const char* name, double bytes) {
    rows.push_back({model + " heap_bytes " + name, bytes, kNoFigure, kNoFigure});
  };
  add("BundleView", opened - before);
  add("PoseLoop", made - opened);
  add("PoseLoop searching", heap_bytes() - opened);
  return {};
}

/// Name of the model of the bundle's first scene.
Result<std::string> scene_model(const std::string& path) {
  const Result<MappedFile> file = MappedFile::open(path);
  if (!file) return tl::unexpected(file.error());
  const Result<BundleView> bundle = BundleView::open(file->bytes());
  if (!bundle) return tl::unexpected(bundle.error());
  if (bundle->scenes().empty()) {
    return fail(ExitCode::kUsage, "bench.scene", path,
                "no scene of the bundle binds a model to a pattern", "bake it with --scene");
  }
  return std::string(bundle->name(bundle->models()[bundle->scenes()[0].model].name));
}

}  // namespace

std::vector<BenchRow> display_rows(const std::string& model, const PlayedRun& run) {
  PaperSession sessions[2] = {kNoSession, kNoSession};
  for (const PaperModel& paper : kPaperModels) {
    if (model != paper.name) continue;
    sessions[0] = paper.low_end;
    sessions[1] = paper.mid_range;
  }
  std::vector<BenchRow> rows;
  const auto add = [&](const std::string& figure, double ours, double reference) {
    rows.push_back({model + " " + figure, ours, reference, ratio(ours, reference)});
  };
  constexpr const char* kDevices[2] = {"low_end", "mid_range"};
  const Loading loaded = loading(run.frames);
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string device = std::string("_") + kDevices[i];
    add("table9_recognition_fps" + device, recognition_fps(run.frames),
        sessions[i].recognition_fps);
    add("table9_loading_fps" + device, loaded.fps, sessions[i].loading_fps);
    add("table9_loading_s" + device, loaded.seconds, sessions[i].loading_s);
    add("table9_display_fps" + device, display_fps(run.frames), sessions[i].display_fps);
    add("table9_display_s" + device, display_s(run.frames), sessions[i].display_s);
    add("table9_stutters" + device, static_cast<double>(run.late), sessions[i].stutters);
  }
  add("table9_cpu_percent", run.cpu_percent, kNoFigure);
  add("pictures", static_cast<double>(run.frames.size()), kNoFigure);
  add("dropped_frames", static_cast<double>(run.dropped), kNoFigure);
  return rows;
}

Result<std::vector<BenchRow>> bench_display_rows(const BenchOptions& command) {
  std::vector<BenchRow> rows;
  for (const std::string& path : command.inputs) {
    const Result<std::string> model = scene_model(path);
    if (!model) return tl::unexpected(model.error());
    std::vector<std::vector<BenchRow>> runs;
    for (int i = 0; i < kPlayedRuns; ++i) {
      MODAR_ASSIGN(const PlayedRun run, play(path, command));
      runs.push_back(display_rows(*model, run));
    }
    const std::vector<BenchRow> more = mean_rows(runs);
    rows.insert(rows.end(), more.begin(), more.end());
    MODAR_TRY(add_heap(path, *model, rows));
  }
  return rows;
}

}  // namespace modar
