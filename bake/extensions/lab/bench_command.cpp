// `modar-lab bench`: figures as ratios, ours and the reference side by side in one run.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>

#include "bake/extensions/lab/bench.hpp"
#include "bake/extensions/lab/commands.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"

namespace modar {
namespace {

Result<ExitCode> print_rows(const BenchOptions& bench) {
  MODAR_ASSIGN(const auto rows, run_bench(bench));
  if (bench.json) {
    Json list = Json::array();
    for (const BenchRow& row : rows) {
      list.push_back({{"measure", row.measure},
                      {"ours", row.ours},
                      {"reference", row.reference},
                      {"ratio", row.ratio}});
    }
    std::fputs(list.dump().c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("%-32s %14s %14s %10s\n", "measure", "ours", "reference", "ratio");
  for (const BenchRow& row : rows) {
    std::printf("%-32s %14.6g %14.6g %10.4g\n", row.measure.c_str(), row.ours, row.reference,
                row.ratio);
  }
  return ExitCode::kOk;
}

void add_pose_options(CommandLine& line, PoseBenchRequest& pose) {
  line.group("Tracking: pose, wild, extended, clutter (light and render where it says so)");
  line.option(
      "--patterns", &pose.patterns,
      "Folder of pattern pictures, or one picture (light: one picture; wild: patterns to look for "
      "in clips that show none)");
  line.option("--backgrounds", &pose.backgrounds, "Folder of photos without a pattern");
  line.group("Tracking: pose, wild, extended, clutter (light and render where it says so)",
             Shown::kInFull);
  line.option("--video", &pose.video,
              "Also measure on a video (extended: a video to blank; render: play it headless)");
  line.option("--truth", &pose.truth, "True corners of the video's pattern (CSV)");
  line.option("--video-pattern", &pose.video_pattern,
              "Picture of the video's pattern (default: pattern.png in the video's folder)");
  line.option("--frames", &pose.frames, "Rendered frames per band and pattern",
              {.least = 1, .most = 100000});
  line.option("--clutter", &pose.clutter, "Total frames without a pattern",
              {.least = 1, .most = 10000000});
  line.flag("--tables", pose.tables,
            "Reproduce Tables 6 to 8 of the ModAR paper with its four parameter sets, on pictures "
            "that are blurred to its counts of features; shipped_features: without blur");
  line.flag("--scores", pose.scores,
            "Compare the patterns' scores with their measured working ranges");
  line.flag("--many", pose.many, 50,
            "Use 1, 10 and 50 patterns at once (--many=N: N): detection, set-up, recovery after "
            "occlusion");
  line.flag("--field", pose.field,
            "Simulate phone cameras: blur, low light, JPEG, glare, rolling shutter, bent paper, "
            "mirrored prints, other editions");
  line.flag("--shape", pose.shape,
            "Labels on cylinders and cones, and boxes, from 0 to 70 degrees about the axis");
  line.flag("--copies", pose.copies, "clutter: phantom copies of the one print that is in view");
  line.flag("--lookalikes", pose.lookalikes,
            "Two seconds each of other editions, mirror images and covered prints");
  line.option("--path", &pose.path,
              "Replay a camera path: one homography (9 numbers) or pose (12) per line");
  line.flag("--sift", pose.sift, "Compare with OpenCV's SIFT and MAGSAC on the same frames");
  line.flag("--known-camera", pose.known_camera,
            "Give the tracker the lens and aspect (default: drawn at random and unknown to it)");
  line.option("--held", &pose.held,
              "Hold each view for N frames and track it; the last frame counts (default 1)",
              {.type = "N", .least = 1, .most = 1000});
  line.option("--parameters", &pose.parameters,
              "Parameter set of the ModAR paper's method; none: leave it out");
  line.option("--only", &pose.only, "Bands or clips whose name contains this text");
  line.option("--seed", &pose.seed, "Random seed of the rendered frames");
}

}  // namespace

void add_bench(CommandLine& program) {
  CommandLine& line =
      program.command("bench", "Measure quality and speed, next to a reference in the same run");
  const auto bench = std::make_shared<BenchOptions>();
  bench->model.jobs = std::max(1u, std::thread::hardware_concurrency());
  line.option("name", &bench->name, "Name of the bench; an unknown name lists them all",
              {.type = "NAME", .required = true});
  line.option("inputs", &bench->inputs, "Input files of the bench");
  line.option("--crop", &bench->crop, "etc1: side of the centre crop, in pixels");
  line.option("-o,--output", &bench->output, "light: existing folder for the pictures",
              {.type = "FOLDER"});
  line.option("--light", &bench->light,
              "light: panorama of the room of the gloss, metal and clay (default: a made one)");
  line.option("--device", &bench->device, "render: draw as this device would (assets/devices)");
  line.option("--obj", &bench->model.obj, "model: measure this OBJ instead of a generated one");
  line.flag("--big", bench->model.big, "model: 14.6 million triangles, takes minutes");
  line.option("--jobs", &bench->model.jobs, "model: threads of ModAR's runs",
              {.shows_default = true, .least = 1, .most = 256});
  line.flag("--json", bench->json, "Print the rows as JSON");
  line.flag("--quiet", bench->pose.quiet, "No progress bar");
  add_pose_options(line, bench->pose);
  line.footer(example(
      "  modar-lab bench load spider.modar --json\n"
      "  modar-lab bench model scan.obj --big --json\n"
      "  modar-lab bench pose --patterns patterns --backgrounds photos --frames 100 --json\n"));
  line.run([bench] { return print_rows(*bench); });
}

}  // namespace modar
