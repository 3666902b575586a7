// `modar-lab bench pose`: our tracker compared with the ModAR paper's method on rendered frames of
// known pose and on a video with its truth.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/extensions/lab/lookalike_bench.hpp"
#include "bake/extensions/lab/many_bench.hpp"
#include "bake/extensions/lab/pose_bench.hpp"
#include "bake/extensions/lab/score_bench.hpp"
#include "bake/extensions/lab/shape_bench.hpp"
#include "bake/io/terminal.hpp"
#include "modar/features.hpp"

namespace modar {
namespace {

/// Bands of the tracking part.
constexpr BenchPath kPaths[] = {{"tracking", 1.0, 0.0, 0.0},
                                {"tracking fast", 3.0, 0.5, 0.0},
                                {"tracking x10", 10.0, 0.0, 0.0},
                                {"tracking hand x4", 4.0, 0.5, 0.0},
                                {"tracking shake", 1.0, 0.5, 1.0}};

double percent(int part, int whole) {
  return whole > 0 ? 100.0 * part / whole : 0.0;
}

/// Rows of one band of one method; reference: of the same band, null: none.
void add_band(const PoseBenchRow& own, const PoseBenchRow* reference, const std::string& band,
              std::vector<BenchRow>& rows) {
  const auto add = [&](const std::string& what, auto&& value) {
    const double theirs = reference != nullptr ? value(*reference) : kNoFigure;
    rows.push_back(
        {what + " " + band, value(own), theirs, theirs != 0.0 ? value(own) / theirs : kNoFigure});
  };
  const auto with = [](const PoseBenchRow& row) { return row.frames - row.without_pattern; };
  if (own.without_pattern > 0) {
    add("false_pct",
        [](const PoseBenchRow& row) { return percent(row.false_found, row.without_pattern); });
  }
  if (own.frames > own.without_pattern) {
    add("recognised_pct",
        [&](const PoseBenchRow& row) { return percent(row.recognised, with(row)); });
    add("right_pct", [&](const PoseBenchRow& row) { return percent(row.right, with(row)); });
    if (own.detailed) {
      // As benchmarks of planar tracking report them: precision within 5 and within 15 pixels, of
      // all frames.
      add("P@5", [&](const PoseBenchRow& row) { return percent(row.right, with(row)); });
      add("P@15", [&](const PoseBenchRow& row) { return percent(row.within_15, with(row)); });
    }
    if (own.detailed || own.sequence) {
      add("worst_px", [](const PoseBenchRow& row) { return row.worst_px; });
    }
    add("error_px", [](const PoseBenchRow& row) { return row.error_px; });
    if (own.shown_px > 0) {
      add("shown_error_px", [](const PoseBenchRow& row) { return row.shown_px; });
      add("beside_pct", [&](const PoseBenchRow& row) { return percent(row.beside, with(row)); });
    }
  }
  if (own.sequence) {
    add("held_wrong_frames", [](const PoseBenchRow& row) { return 1.0 * row.held_wrong; });
  }
  if (own.sequence) add("jitter_px", [](const PoseBenchRow& row) { return row.jitter_px; });
  add("cpu_ms", [](const PoseBenchRow& row) { return row.ms; });
}

/// Rows of all bands: ours compared with the paper's where it ran, and SIFT's.
void add_rows(const std::vector<PoseBenchRow>& measured, std::vector<BenchRow>& rows) {
  for (const PoseBenchRow& own : measured) {
    if (own.method == "paper") continue;
    const PoseBenchRow* paper = nullptr;
    for (const PoseBenchRow& other : measured) {
      if (other.band == own.band && other.method == "paper") paper = &other;
    }
    const bool ours = own.method == "ours";
    add_band(own, ours ? paper : nullptr, ours ? own.band : own.band + " " + own.method, rows);
  }
}

/// Stages over all rendered bands, weighted by their frames.
void add_stages(const std::vector<PoseBenchRow>& measured, std::vector<BenchRow>& rows) {
  constexpr const char* kNames[4] = {"detect_ms", "describe_ms", "match_ms", "geometry_ms"};
  for (std::size_t stage = 0; stage < 4; ++stage) {
    double sums[2] = {0, 0};
    double frames[2] = {0, 0};
    for (const PoseBenchRow& row : measured) {
      if (row.sequence || row.method == "sift") continue;
      const std::size_t method = row.method == "ours" ? 0 : 1;
      sums[method] += row.stages_ms[stage] * row.frames;
      frames[method] += row.frames;
    }
    const double ours = sums[0] / std::max(frames[0], 1.0);
    const double paper = frames[1] > 0 ? sums[1] / frames[1] : std::nan("");
    rows.push_back({std::string(kNames[stage]) + " detection", ours, paper,
                    paper > 0 ? ours / paper : std::nan("")});
  }
}

Result<PoseBenchOptions> options_of(const PoseBenchRequest& command) {
  PoseBenchOptions options;
  options.frames = command.frames;
  options.seed = command.seed;
  options.clutter_frames = command.clutter;
  options.many = command.many;
  options.sift = command.sift;
  options.known_camera = command.known_camera;
  options.held = command.held;
  MODAR_ASSIGN(options.paper_set, paper_set_named(command.parameters));
  for (const SceneBand& band : pose_bands()) {
    if (band.name.find(command.only) != std::string::npos) options.bands.push_back(band);
  }
  MODAR_ASSIGN(options.patterns, pictures_of(command.patterns));
  MODAR_ASSIGN(options.backgrounds, pictures_of(command.backgrounds));
  return options;
}

/// Scores compared with working ranges, and their rank correlation.
Result<std::vector<BenchRow>> score_rows(const PoseBenchOptions& options,
                                         const ProgressCallback& progress) {
  MODAR_ASSIGN(const auto scores, bench_scores(options, progress));
  std::vector<BenchRow> rows;
  std::vector<double> of_score[3];  // all, the half that it was tuned on, the other
  std::vector<double> of_grade[3];
  std::vector<double> of_range[3];
  for (const ScoreBenchRow& one : scores) {
    const ScoreRange& range = one.measured;
    const double value = range_value(range);
    rows.push_back({"score " + one.name, 1.0 * one.score, value, kNoFigure});
    rows.push_back({"grade " + one.name, one.graded, value, one.graded / value});
    rows.push_back({"farthest " + one.name, range.farthest, kNoFigure, kNoFigure});
    rows.push_back({"tilt_deg " + one.name, range.tilt_deg, kNoFigure, kNoFigure});
    rows.push_back({"covered " + one.name, range.covered_share, kNoFigure, kNoFigure});
    for (const std::size_t group : {std::size_t{0}, one.tuned ? std::size_t{1} : std::size_t{2}}) {
      of_score[group].push_back(one.score);
      of_grade[group].push_back(one.graded);
      of_range[group].push_back(value);
    }
  }
  constexpr const char* kGroups[] = {"all", "tuned", "other"};
  for (std::size_t group = 0; group < 3; ++group) {
    const auto add = [&](const char* what, const std::vector<double>& values) {
      rows.push_back({std::string(what) + kGroups[group], rank_correlation(values, of_range[group]),
                      kNoFigure, kNoFigure});
    };
    add("rank_correlation ", of_score[group]);
    add("rank_correlation of grade ", of_grade[group]);
  }
  return rows;
}

Result<std::vector<BenchRow>> many_rows(const PoseBenchOptions& options, const std::string& only,
                                        const ProgressCallback& progress) {
  MODAR_ASSIGN(const auto measured, bench_many(options, only, progress));
  std::vector<BenchRow> rows;
  for (const ManyBenchRow& row : measured) {
    const bool held = row.reference > 0;
    rows.push_back({row.measure + " x" + std::to_string(row.patterns), row.value,
                    held ? row.reference : kNoFigure,
                    held ? row.value / row.reference : kNoFigure});
  }
  return rows;
}

Result<std::vector<BenchRow>> lookalike_rows(const PoseBenchOptions& options,
                                             const std::string& only,
                                             const ProgressCallback& progress) {
  MODAR_ASSIGN(const auto measured, bench_lookalikes(options, only, progress));
  std::vector<BenchRow> rows;
  for (const LookalikeRow& row : measured) {
    rows.push_back({row.measure + "_pct", row.percent, kNoFigure, kNoFigure});
  }
  return rows;
}

}  // namespace

Result<std::uint32_t> paper_set_named(const std::string& name) {
  for (const ParameterSetRecord& set : paper_parameter_sets()) {
    if (name == parameter_set_name(set.id)) return set.id;
  }
  if (name == "none") return 0;
  return fail(ExitCode::kUsage, "parameters.unknown", "--parameters",
              "there is no parameter set '" + name + "'",
              "name one of the paper's sets, or none to run ours alone");
}

Result<std::vector<BenchRow>> bench_pose_rows(const PoseBenchRequest& command) {
  ProgressBar bar(command.quiet);
  const auto progress = [&bar](const std::string& what, double done) { bar.show(what, done); };
  std::vector<PoseBenchRow> measured;
  const auto take = [&measured](const std::vector<PoseBenchRow>& rows) {
    measured.insert(measured.end(), rows.begin(), rows.end());
  };
  MODAR_ASSIGN(const PoseBenchOptions options, options_of(command));
  if (command.scores || command.tables || command.lookalikes || command.many > 0) {
    auto rows = command.many > 0     ? many_rows(options, command.only, progress)
                : command.lookalikes ? lookalike_rows(options, command.only, progress)
                : command.scores     ? score_rows(options, progress)
                                     : paper_rows(options, progress);
    bar.clear();
    return rows;
  }
  const auto take_detailed = [&take](std::vector<PoseBenchRow> rows) {
    for (PoseBenchRow& row : rows) row.detailed = true;
    take(rows);
  };
  if (command.shape) {
    MODAR_ASSIGN(auto rows, bench_shapes(options, command.only, progress));
    take_detailed(std::move(rows));
  }
  const bool others = command.field || command.shape || !command.path.empty();
  if (command.field) {
    MODAR_ASSIGN(auto rows, bench_field(options, command.only, progress));
    take_detailed(std::move(rows));
  }
  if (!command.path.empty()) {
    MODAR_ASSIGN(auto rows, bench_path(options, command.path, progress));
    take_detailed(std::move(rows));
  }
  if (!others && !options.bands.empty()) {
    MODAR_ASSIGN(const auto rows, bench_detection(options, progress));
    take(rows);
  }
  for (const BenchPath& path : kPaths) {
    if (others || std::string(path.name).find(command.only) == std::string::npos) continue;
    MODAR_ASSIGN(const auto rows, bench_tracking(options, path, progress));
    take(rows);
  }
  if (!command.video.empty()) {
    const VideoBench video{command.video, command.truth, command.video_pattern};
    MODAR_ASSIGN(const auto rows, bench_video(options, video, progress));
    take(rows);
  }
  bar.clear();
  std::vector<BenchRow> rows;
  add_rows(measured, rows);
  if (!others) add_stages(measured, rows);
  return rows;
}

}  // namespace modar
