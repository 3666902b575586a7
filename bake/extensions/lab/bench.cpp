// `modar-lab bench NAME`: figures as ratios, ours and the reference side by side in one run.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/extensions/lab/bench_parts.hpp"
#include "bake/extensions/lab/clutter_bench.hpp"
#include "bake/extensions/lab/etc1_bench.hpp"
#include "bake/extensions/lab/extended_bench.hpp"
#include "bake/extensions/lab/light_bench.hpp"
#include "bake/extensions/lab/lod_bench.hpp"
#include "bake/extensions/lab/reasons_bench.hpp"
#include "bake/extensions/lab/render_bench.hpp"
#include "bake/extensions/lab/ship_bench.hpp"
#include "bake/extensions/lab/views_bench.hpp"
#include "bake/extensions/lab/wild_bench.hpp"
#include "bake/io/terminal.hpp"
#include "formats/base/path.hpp"
#include "formats/bundle_view.hpp"
#include "modar/mapped_file.hpp"

namespace modar {
namespace {

using BenchResult = Result<std::vector<BenchRow>>;

struct Bench {
  const char* name;
  bool needs_inputs;
  const char* inputs;  ///< what its arguments are
  const char* summary;
  std::function<BenchResult(const BenchOptions&)> run;
};

/// Median milliseconds of `repeats` runs.
double median_ms(int repeats, const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    times.push_back(ms.count());
  }
  std::nth_element(times.begin(), times.begin() + repeats / 2, times.end());
  return times[static_cast<std::size_t>(repeats / 2)];
}

/// Opening a bundle (map, validate headers and tables) against copying its bytes once, which is the
/// least that any format pays that has to be read.
BenchResult bench_load(const BenchOptions& command) {
  std::vector<BenchRow> rows;
  for (const std::string& path : command.inputs) {
    Result<MappedFile> warm = MappedFile::open(path);
    if (!warm) return tl::unexpected(warm.error());
    std::vector<std::byte> copy(warm->bytes().size());
    bool opened = true;
    const double open_ms = median_ms(51, [&] {
      Result<MappedFile> file = MappedFile::open(path);
      opened = opened && file && BundleView::open(file->bytes());
    });
    if (!opened) {
      return fail(ExitCode::kInvalidInput, "bench.bundle", path, "this is not a valid bundle",
                  "see what `modar check` says of it");
    }
    const double copy_ms = median_ms(
        51, [&] { std::memcpy(copy.data(), warm->bytes().data(), warm->bytes().size()); });
    rows.push_back({"open_ms " + file_stem(path), open_ms, copy_ms, open_ms / copy_ms});
  }
  return rows;
}

/// Our ETC1 encoder at its three efforts compared with Android's libetc1.
BenchResult bench_etc1_rows(const BenchOptions& command) {
  Result<std::vector<Etc1BenchRow>> measured = bench_etc1(command.inputs, command.crop);
  if (!measured) return tl::unexpected(measured.error());
  std::vector<BenchRow> rows;
  for (const Etc1BenchRow& row : *measured) {
    rows.push_back({row.measure, row.ours, row.reference, row.ratio});
  }
  return rows;
}

/// What bundles cost on the way, compared with Draco, meshoptimizer's codecs and zstd.
BenchResult bench_ship_rows(const BenchOptions& command) {
  const auto measured = bench_ship(command.inputs, 1);
  if (!measured) return tl::unexpected(measured.error());
  std::vector<BenchRow> rows;
  for (const ShipBenchRow& row : *measured) {
    rows.push_back({row.measure, row.ours, row.reference, row.ours / row.reference});
  }
  return rows;
}

/// Copies of models in the ModAR paper's four ways, loading and culling; or the player on a video.
BenchResult bench_render_rows(const BenchOptions& command) {
  if (!command.pose.video.empty()) return bench_display_rows(command);
  ProgressBar bar(command.pose.quiet || command.json);
  RenderBenchOptions options;
  options.device = command.device;
  options.progress = [&bar](std::uint64_t done, std::uint64_t all) {
    bar.show("drawing", static_cast<double>(done) / static_cast<double>(all));
  };
  const auto measured = bench_render(command.inputs, options);
  bar.clear();
  if (!measured) return tl::unexpected(measured.error());
  std::vector<BenchRow> rows;
  for (const RenderBenchRow& row : *measured) {
    const double quotient = ratio(row.ours, row.reference);
    rows.push_back({row.measure, row.ours, row.reference, quotient});
  }
  return rows;
}

/// Shading compared with plain shading, both as they differ from a path tracer.
BenchResult bench_light_rows(const BenchOptions& command) {
  if (!command.inputs.empty() && command.inputs[0].ends_with(".modar")) {
    return bench_before_after(command.inputs, command.output);
  }
  if (command.pose.patterns.empty()) {
    return fail(ExitCode::kUsage, "bench.inputs", command.name, "models need a pattern below them",
                "modar-lab bench light MODEL[,up=y]... --patterns PICTURE [-o FOLDER]");
  }
  ProgressBar bar(command.pose.quiet || command.json);
  LightBenchOptions options;
  options.models = command.inputs;
  options.pattern = command.pose.patterns;
  options.folder = command.output;
  options.light = command.light;
  options.jobs = command.model.jobs;
  options.progress = [&bar](double done) { bar.show("drawing", done); };
  return bench_light(options);
}

/// Poses that follow from the surroundings compared with the goals for them.
BenchResult bench_extended_rows(const BenchOptions& command) {
  ProgressBar bar(command.pose.quiet || command.json);
  PoseBenchOptions options;
  options.width = 640;
  options.height = 480;
  options.seed = command.pose.seed;
  std::vector<ExtendedRow> measured;
  if (!command.pose.patterns.empty() || command.pose.video.empty()) {
    MODAR_ASSIGN(options.patterns, pictures_of(command.pose.patterns));
    MODAR_ASSIGN(options.backgrounds, pictures_of(command.pose.backgrounds));
    MODAR_ASSIGN(measured, bench_extended(options, command.pose.only,
                                          [&bar](const std::string& what, double done) {
                                            bar.show(what, done);
                                          }));
  }
  if (!command.pose.video.empty()) {
    MODAR_ASSIGN(measured.emplace_back(),
                 bench_extended_video({command.pose.video, "", command.pose.video_pattern}));
  }
  bar.clear();
  std::vector<BenchRow> rows;
  for (const ExtendedRow& row : measured) {
    const double half = row.gyroscope ? 0.5 : 1.0;
    const auto add = [&](const char* what, double value, double goal) {
      rows.push_back({what + (" " + row.scene), value, goal, ratio(value, goal)});
    };
    add("followed_pct", ratio(100.0 * row.followed, row.unseen), kNoFigure);
    if (row.direct_px > 0) add("seen_p95_px", row.seen_px, row.direct_px);
    if (row.followed == 0) continue;
    add("position_pct", row.position_pct, 3 * half);
    add("rotation_deg", row.rotation_deg, half);
    add("worst_position_pct", row.worst_position_pct, kNoFigure);
    add("worst_rotation_deg", row.worst_rotation_deg, kNoFigure);
    add("honest_pct", row.honest_pct, 95);
    add("jump_px", row.jump_px, 5);
    add("cpu_ms", row.ms, 3);
  }
  return rows;
}

/// False finds.
BenchResult bench_clutter_rows(const BenchOptions& command) {
  PoseBenchOptions options;
  options.seed = command.pose.seed;
  options.known_camera = command.pose.known_camera;
  options.clutter_frames = command.pose.clutter > 0 ? command.pose.clutter : 20000;
  if (!command.pose.patterns.empty()) {
    MODAR_ASSIGN(options.patterns, pictures_of(command.pose.patterns));
  }
  MODAR_ASSIGN(options.backgrounds, pictures_of(command.pose.backgrounds));
  ProgressBar bar(command.pose.quiet || command.json);
  const ProgressCallback show = [&bar](const std::string& what, double done) {
    bar.show(what, done);
  };
  auto rows = command.pose.copies ? bench_phantoms(options, show) : bench_clutter(options, show);
  bar.clear();
  return rows;
}

/// Reasons of views without a find.
BenchResult bench_reasons_rows(const BenchOptions& command) {
  PoseBenchOptions options;
  options.seed = command.pose.seed;
  options.known_camera = command.pose.known_camera;
  options.frames = command.pose.frames;
  MODAR_ASSIGN(options.patterns, pictures_of(command.pose.patterns));
  MODAR_ASSIGN(options.backgrounds, pictures_of(command.pose.backgrounds));
  ProgressBar bar(command.pose.quiet || command.json);
  auto rows = bench_reasons(options, command.pose.only,
                            [&bar](const std::string& what, double done) { bar.show(what, done); });
  bar.clear();
  return rows;
}

/// Videos of real things, compared with other methods.
BenchResult bench_wild_rows(const BenchOptions& command) {
  WildBenchOptions options;
  options.folder = command.inputs[0];
  options.only = command.pose.only;
  options.bake.jobs = command.model.jobs;
  MODAR_ASSIGN(options.paper_set, paper_set_named(command.pose.parameters));
  if (!command.pose.patterns.empty()) {
    MODAR_ASSIGN(options.more_patterns, pictures_of(command.pose.patterns));
  }
  ProgressBar bar(command.pose.quiet || command.json);
  auto rows =
      bench_wild(options, [&bar](const std::string& what, double done) { bar.show(what, done); });
  bar.clear();
  return rows;
}

const std::vector<Bench>& benches() {
  static const std::vector<Bench> all = {
      {"load", true, "BUNDLE...", "opening a bundle (ours), next to copying its bytes (reference)",
       bench_load},
      {"etc1", true, "IMAGE... [--crop SIDE]", "the ETC1 encoder, next to Android's libetc1",
       bench_etc1_rows},
      {"ship", true, "BUNDLE|MODEL...",
       "bytes and decoding of what travels, against Draco, meshopt and zstd; models are baked with "
       "the default options",
       bench_ship_rows},
      {"render", true, "BUNDLE... [--device NAME] [--video FILE]",
       "ten copies in the ModAR paper's ways, loading, culling, against index rendering from "
       "arrays; "
       "or "
       "the player on a video, against the ModAR paper's Table 9",
       bench_render_rows},
      {"light", false, "MODEL[,up=y]... --patterns PICTURE | BUNDLE PHOTO... [-o FOLDER]",
       "models on a pattern, a plant and a glass besides: colour error (CIEDE2000) compared with a "
       "path "
       "tracer, against plain shading; or a bundle's models on photos, before and after",
       bench_light_rows},
      {"model", false, "SCAN [--big] | --obj FILE",
       "reading and baking a large OBJ (made from the scan), against tinyobjloader, assimp, "
       "gltfpack, Draco and the goals",
       [](const BenchOptions& command) { return bench_model_rows(command.inputs, command.model); }},
      {"lod", true, "MODEL...", "levels of detail, next to meshopt_simplify on the whole mesh",
       [](const BenchOptions& command) { return bench_lod(command.inputs, command.model.jobs); }},
      {"views", true, "FINEST OURS REFERENCE",
       "pictures of a bundle's levels next to another bundle of as many triangles",
       [](const BenchOptions& command) { return bench_views(command.inputs); }},
      {"pose", false, "--patterns DIR --backgrounds DIR [--video FILE [--truth CSV]]",
       "the pose loop next to the ModAR paper's method, on the same frames",
       [](const BenchOptions& command) { return bench_pose_rows(command.pose); }},
      {"extended", false, "--patterns DIR --backgrounds DIR | --video FILE",
       "the pose of a pattern out of sight, in rendered rooms, or blanked in a video, against the "
       "goals",
       bench_extended_rows},
      {"clutter", false, "--backgrounds DIR [--patterns DIR] [--clutter N] [--copies]",
       "frames (20,000 of them) in which 30 hard patterns are found that they do not show, or "
       "copies of them, next to all frames",
       bench_clutter_rows},
      {"reasons", false, "--patterns DIR --backgrounds DIR [--frames N] [--only TEXT]",
       "the reason why nothing is shown in N views of each of ten causes, next to all views",
       bench_reasons_rows},
      {"wild", true, "CLIPS [--patterns DIR] [--only TEXT] [--parameters none]",
       "a folder of videos of real things with their truths (ours, POT-210, PlanarTrack): the pose "
       "loop with an unknown camera, against SIFT and ORB with a RANSAC homography and the ModAR "
       "paper's method",
       bench_wild_rows},
  };
  return all;
}

}  // namespace

Result<std::vector<BenchRow>> run_bench(const BenchOptions& options) {
  std::string names;
  for (const Bench& bench : benches()) {
    names += std::string("\n  ") + bench.name + " " + bench.inputs + ": " + bench.summary;
    if (options.name != bench.name) continue;
    if (bench.needs_inputs && options.inputs.empty()) {
      return fail(ExitCode::kUsage, "bench.inputs", options.name, "it needs input files",
                  std::string("modar-lab bench ") + bench.name + " " + bench.inputs);
    }
    return bench.run(options);
  }
  return fail(ExitCode::kUsage, "bench.unknown", options.name, "there is no such bench",
              "there are:" + names);
}

}  // namespace modar
