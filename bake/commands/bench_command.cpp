// `modar bench`: figures as ratios, ours and the reference side by side in one run.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>

#include "bake/commands/commands.hpp"
#include "bake/json.hpp"
#include "bake/lab/bench.hpp"
#include "bake/terminal.hpp"

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
  line.option(
      "--patterns", &pose.patterns,
      "pose: folder of pattern pictures, or one picture; light: one; wild: to look for, too, "
      "in clips that show none");
  line.option("--backgrounds", &pose.backgrounds, "pose: folder of photos without a pattern");
  line.option("--video", &pose.video,
              "pose: a video as well; extended: one to blank; render: the player on it");
  line.option("--truth", &pose.truth, "pose: corners of the video's pattern (CSV)");
  line.option("--video-pattern", &pose.video_pattern,
              "pose: picture of the video's pattern (default: pattern.png beside the video)");
  line.option("--frames", &pose.frames, "pose: rendered frames a band and pattern",
              {.least = 1, .most = 100000});
  line.option("--clutter", &pose.clutter, "pose: frames without a pattern, in all",
              {.least = 1, .most = 10000000});
  line.flag("--tables", pose.tables,
            "pose: the ModAR paper's Tables 6 to 8 and accuracy beside its four sets and ours");
  line.flag("--scores", pose.scores,
            "pose: the patterns' scores beside their working ranges, and how well they agree");
  line.flag(
      "--many", pose.many, 50,
      "pose: 1, 10 and 50 (--many=N: N) patterns: detection, set-up, return from behind things");
  line.flag("--field", pose.field,
            "pose: frames as phones take them: blur, low light, JPEG, glare, rolling shutter, bent "
            "paper, mirrored prints, other editions");
  line.flag("--shape", pose.shape,
            "pose: labels on cylinders and cones, and boxes, from 0 to 70 degrees about the axis");
  line.flag("--lookalikes", pose.lookalikes,
            "pose: two seconds each of other editions, mirror images and covered prints");
  line.option("--path", &pose.path,
              "pose: replay a camera path: a homography (9 numbers) or pose (12) a line");
  line.flag("--sift", pose.sift, "pose: OpenCV's SIFT with MAGSAC on the same frames");
  line.flag("--known-camera", pose.known_camera,
            "pose: tell the tracker lens and aspect, which are unknown to it and drawn at random "
            "otherwise");
  line.option("--parameters", &pose.parameters,
              "pose, wild: set of the ModAR paper's method, none: ours alone");
  line.option("--only", &pose.only, "pose, wild: bands or clips whose name holds this text");
  line.option("--seed", &pose.seed, "pose: of the rendered frames");
  line.flag("--quiet", pose.quiet, "No progress bar");
}

}  // namespace

void add_bench(CommandLine& program) {
  CommandLine& line = program.command("bench", "Measure, as ratios to a reference in the same run");
  const auto bench = std::make_shared<BenchOptions>();
  bench->model.jobs = std::max(1u, std::thread::hardware_concurrency());
  line.option("name", &bench->name, "Which bench; an unknown name lists them",
              {.type = "NAME", .required = true});
  line.option("inputs", &bench->inputs, "Its input files");
  line.option("--crop", &bench->crop, "etc1: side of the centre crop, in pixels");
  line.option("-o,--output", &bench->output, "light: folder that exists, for the pictures",
              {.type = "FOLDER"});
  line.option("--device", &bench->device, "render: draw as this device would (assets/devices)");
  line.option("--obj", &bench->model.obj, "model: measure this OBJ instead of making one");
  line.flag("--big", bench->model.big, "model: of 14.6 million triangles, some minutes");
  line.option("--jobs", &bench->model.jobs, "model: threads of our own runs",
              {.shows_default = true, .least = 1, .most = 256});
  add_pose_options(line, bench->pose);
  line.flag("--json", bench->json, "Print the rows as JSON");
  line.footer(
      example("  modar bench load spider.modar --json\n"
              "  modar bench model scan.obj --big --json\n"
              "  modar bench pose --patterns patterns --backgrounds photos --frames 100 --json\n"));
  line.run([bench] { return print_rows(*bench); });
}

}  // namespace modar
