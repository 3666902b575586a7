// The command line of `modar`, told to CLI11 and taken from it as plain structs.
#include "bake/commands/cli.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "bake/commands/arguments.hpp"
#include "bake/commands/check_command.hpp"
#include "bake/commands/commands.hpp"
#include "bake/commands/ship_command.hpp"
#include "bake/mesh/lod/mesh_levels.hpp"
#include "bake/terminal.hpp"
#include "modar/device_profile.hpp"
#include "modar/features.hpp"

#ifndef MODAR_VERSION
#error "CMake defines MODAR_VERSION"
#endif

namespace modar {
namespace {

/// Options as text, before they are parsed into a command.
struct BakeTexts {
  std::vector<std::string> patterns;
  std::vector<std::string> scenes;
  std::string unit;
  std::string max_error;
  std::string device;
};

void add_texture_options(CLI::App& sub, TextureOptions& textures) {
  sub.add_option("--max-texture", textures.max_side, "Longest side of a texture, in pixels")
      ->check(CLI::Range(4u, kMaxTextureSide))
      ->capture_default_str();
  sub.add_flag("!--no-mipmaps", textures.mipmaps, "Store level 0 of textures only");
  const std::map<std::string, Etc1Effort> efforts = {
      {"fast", Etc1Effort::kFast}, {"good", Etc1Effort::kGood}, {"best", Etc1Effort::kBest}};
  sub.add_option("--effort", textures.effort, "Of the ETC1 encoder: fast, good (default) or best")
      ->transform(CLI::CheckedTransformer(efforts).description(""))
      ->type_name("EFFORT");
  sub.add_flag("--perceptual", textures.perceptual, "Weigh ETC1 errors as the eye does, by luma");
  sub.add_option("--min-psnr", textures.min_psnr_db, "Report textures below this, in dB");
  sub.add_option("--min-ssim", textures.min_ssim, "Report textures below this")
      ->check(CLI::Range(0.0, 1.0));
  sub.add_option("--texture-pictures", textures.picture_folder,
                 "Write source, decoded and difference of each texture as PNG")
      ->type_name("DIR");
}

void add_geometry_options(CLI::App& sub, BakeRequest& request, BakeTexts& texts) {
  sub.add_option("--unit", texts.unit, "Unit of the models' coordinates: mm, cm, m, km, in, ft");
  sub.add_option("--max-error", texts.max_error,
                 "Of packed positions: source units, a percentage of the diagonal (0.01%), or a "
                 "length (2mm, with --unit)")
      ->type_name("LENGTH");
  const std::map<std::string, PositionKind> kinds = {{"half", PositionKind::kHalf},
                                                     {"int16", PositionKind::kInt16}};
  sub.add_option_function<PositionKind>(
         "--positions", [&request](const PositionKind& kind) { request.positions = kind; },
         "Store them as half or int16 (else: int16 where --max-error needs it)")
      ->transform(CLI::CheckedTransformer(kinds).description(""))
      ->type_name("LAYOUT");
  CLI::Option* levels =
      sub.add_option("--lods", request.levels,
                     "Levels of detail, the finest counted, each of half the triangles before it")
          ->check(CLI::Range(1u, kMaxLevels))
          ->capture_default_str();
  sub.add_flag_callback(
         "--no-lods", [&request] { request.levels = 1; }, "The finest level only")
      ->excludes(levels);
  sub.add_flag("!--no-topology", request.topology, "Do not measure the models' topology");
}

void add_pattern_options(CLI::App& sub, BakeRequest& request) {
  sub.add_option("--loop-views", request.loop.trial_views,
                 "Random views that try a pattern's features: fewer bake faster, more hold better")
      ->check(CLI::Range(1, 10000));
  std::vector<std::string> sets = {"none"};
  for (const ParameterSetRecord& set : paper_parameter_sets()) {
    sets.emplace_back(parameter_set_name(set.id));
  }
  sub.add_option("--parameters", request.parameters,
                 "The article's sets to store beside our record of a pattern, as YML and mapped: " +
                     CLI::detail::join(sets, ", ") + " (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember(sets).description(""))
      ->type_name("SET,SET");
  sub.add_flag("!--no-score", request.loop.score, "Do not score the patterns");
}

CLI::App* add_bake(CLI::App& app, BakeCommand& bake, BakeTexts& texts) {
  CLI::App* sub = app.add_subcommand("bake", "Models and pattern images to one bundle");
  sub->add_option("--model", bake.request.models, "OBJ, glTF or GLB files")->type_name("FILE");
  sub->add_option("--pattern", texts.patterns,
                  "Images of flat things, frontal; :WIDTHmm tells the printed width")
      ->type_name("FILE[:WIDTHmm]");
  sub->add_option(
         "--scene", texts.scenes,
         "Which model stands on which pattern; needed where there is more than one of either")
      ->type_name("PATTERN=MODEL[,scale=S][,up=x|y|z|-x|-y|-z][,offset=X:Y:Z][,centred]");
  sub->add_option("-o,--output", bake.output, "The bundle to write")
      ->required()
      ->type_name("OUT.modar");
  sub->add_flag("--prove-reproducible", bake.prove_reproducible,
                "Bake again with other threads, paths, locale, time zone; compare the bytes");
  add_geometry_options(*sub, bake.request, texts);
  add_texture_options(*sub, bake.request.textures);
  sub->add_option(
         "--device", texts.device,
         "Plan for a device: its texture size and GPU memory (" + device_profile_names() + ")")
      ->type_name("NAME");
  add_pattern_options(*sub, bake.request);
  sub->add_option("--jobs", bake.request.jobs, "Threads; the bytes do not depend on it")
      ->check(CLI::Range(1u, 256u))
      ->capture_default_str();
  sub->add_option("--memory", bake.request.memory_bytes,
                  "Hold the process there (1G, 800M): large arrays live in files beside the bundle")
      ->transform(CLI::AsSizeValue(true))
      ->type_name("SIZE");
  sub->add_flag("--quiet", bake.quiet, "No progress, no summary, no findings on stderr");
  sub->add_flag("--json", bake.json, "Print what was baked, stages and findings as JSON");
  sub->footer(
      example("  modar bake --model spider.obj --pattern box.png:210mm"
              " --scene box=spider,up=y,scale=0.8 -o spider.modar\n"));
  return sub;
}

CLI::App* add_inspect(CLI::App& app, InspectCommand& inspect) {
  CLI::App* sub = app.add_subcommand("inspect", "Show what a bundle holds, or take it out");
  sub->add_option("bundle", inspect.bundle, "The bundle")->required()->type_name("BUNDLE");
  sub->add_option("--extract", inspect.extract,
                  "Write models as GLB, textures as PKM and KTX, patterns as YML")
      ->type_name("DIR");
  sub->add_flag("--json", inspect.json, "Print as JSON");
  sub->footer(example("  modar inspect spider.modar --extract out/\n"));
  return sub;
}

CLI::App* add_bench(CLI::App& app, BenchCommand& bench) {
  CLI::App* sub = app.add_subcommand("bench", "Measure, as ratios to a reference in the same run");
  sub->add_option("name", bench.name, "Which bench; an unknown name lists them")
      ->required()
      ->type_name("NAME");
  sub->add_option("inputs", bench.inputs, "Its input files");
  sub->add_option("--crop", bench.crop, "etc1: side of the centre crop, in pixels");
  sub->add_option("--device", bench.device, "render: draw as this device would (assets/devices)");
  sub->add_option("--obj", bench.model.obj, "model: measure this OBJ instead of making one");
  sub->add_flag("--big", bench.model.big, "model: of 14.6 million triangles, some minutes");
  sub->add_option("--jobs", bench.model.jobs, "model: threads of our own runs")
      ->check(CLI::Range(1u, 256u))
      ->capture_default_str();
  PoseBenchCommand& pose = bench.pose;
  sub->add_option("--patterns", pose.patterns, "pose: folder of pattern pictures, or one picture");
  sub->add_option("--backgrounds", pose.backgrounds, "pose: folder of photos without a pattern");
  sub->add_option("--video", pose.video, "pose: a video as well; render: the player on it instead");
  sub->add_option("--truth", pose.truth, "pose: corners of the video's pattern (CSV)");
  sub->add_option("--video-pattern", pose.video_pattern,
                  "pose: picture of the video's pattern (default: pattern.png beside the video)");
  sub->add_option("--frames", pose.frames, "pose: rendered frames a band and pattern")
      ->check(CLI::Range(1, 100000));
  sub->add_option("--clutter", pose.clutter, "pose: frames without a pattern, in all")
      ->check(CLI::Range(1, 10000000));
  sub->add_flag("--tables", pose.tables,
                "pose: the article's Tables 6 to 8 and accuracy beside its four sets and ours");
  sub->add_flag("--scores", pose.scores,
                "pose: the patterns' scores beside their working ranges, and how well they agree");
  sub->add_flag(
      "--many{50}", pose.many,
      "pose: 1, 10 and 50 (--many=N: N) patterns: detection, set-up, return from behind things");
  sub->add_option("--parameters", pose.parameters,
                  "pose: set of the article's method, none: ours alone");
  sub->add_option("--only", pose.only, "pose: bands whose name holds this text");
  sub->add_option("--seed", pose.seed, "pose: of the rendered frames");
  sub->add_flag("--quiet", pose.quiet, "No progress bar");
  sub->add_flag("--json", bench.json, "Print the rows as JSON");
  sub->footer(
      example("  modar bench load spider.modar --json\n"
              "  modar bench model scan.obj --big --json\n"
              "  modar bench pose --patterns patterns --backgrounds photos --frames 100 --json\n"));
  return sub;
}

int bake_from_texts(BakeCommand& bake, const BakeTexts& texts) {
  for (const std::string& text : texts.patterns) {
    Result<PatternRequest> pattern = parse_pattern(text);
    if (!pattern) return print_error(pattern.error());
    bake.request.patterns.push_back(std::move(*pattern));
  }
  for (const std::string& text : texts.scenes) {
    Result<SceneRequest> scene = parse_scene(text);
    if (!scene) return print_error(scene.error());
    bake.request.scenes.push_back(std::move(*scene));
  }
  if (!texts.unit.empty()) {
    const Result<double> unit = parse_unit(texts.unit);
    if (!unit) return print_error(unit.error());
    bake.request.unit_metres = *unit;
  }
  if (!texts.max_error.empty()) {
    const Result<MaxError> max_error = parse_max_error(texts.max_error);
    if (!max_error) return print_error(max_error.error());
    bake.request.max_error = *max_error;
  }
  if (!texts.device.empty()) {
    if (auto planned = plan_for_device(texts.device, bake.request); !planned) {
      return print_error(planned.error());
    }
  }
  bake.request.tool_version = MODAR_VERSION;
  return run_bake(bake);
}

int parse_and_run(int argc, char** argv) {
  CLI::App app("modar: bakes models and patterns for augmented reality on old phones");
  app.set_version_flag("--version", std::string("modar ") + MODAR_VERSION);
  app.require_subcommand(1);
  app.footer("\n`modar COMMAND --help` shows the options and an example of each command.\n");

  BakeCommand bake;
  bake.request.jobs = std::max(1u, std::thread::hardware_concurrency());
  BakeTexts bake_texts;
  InspectCommand inspect;
  BenchCommand bench;
  bench.model.jobs = bake.request.jobs;
  const CLI::App* bake_sub = add_bake(app, bake, bake_texts);
  CLI::App* pattern_sub =
      app.add_subcommand("pattern", "Work on pattern images: rectify, score, simulate, confusion");
  CLI::App* check_sub = app.add_subcommand("check", "Prove that a bundle is good");
  check_sub->prefix_command();  // it has a command line of its own
  check_sub->set_help_flag();
  const CLI::App* inspect_sub = add_inspect(app, inspect);
  const CLI::App* bench_sub = add_bench(app, bench);
  CLI::App* ship_sub =
      app.add_subcommand("ship", "Releases for devices: keygen, publish, rotate, prune, plan");
  CLI::App* calibrate_sub =
      app.add_subcommand("calibrate", "A camera file from a chessboard or any pattern, filmed");
  for (CLI::App* sub : {pattern_sub, ship_sub, calibrate_sub}) {
    sub->prefix_command();  // it has a command line of its own
    sub->set_help_flag();
  }

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? static_cast<int>(ExitCode::kOk)
                                : static_cast<int>(ExitCode::kUsage);
  }
  bake.words.assign(argv + 1, argv + argc);
  if (bake_sub->parsed()) return bake_from_texts(bake, bake_texts);
  if (pattern_sub->parsed()) return run_pattern(pattern_sub->remaining());
  if (check_sub->parsed()) return run_check_line(check_sub->remaining(), check_against_sources);
  if (inspect_sub->parsed()) return run_inspect(inspect);
  if (bench_sub->parsed()) return run_bench(bench);
  if (calibrate_sub->parsed()) return run_calibrate(calibrate_sub->remaining());
  if (ship_sub->parsed()) return run_ship(ship_sub->remaining());
  return static_cast<int>(ExitCode::kUsage);
}

}  // namespace

int run_modar(int argc, char** argv) {
  return guarded([&] { return parse_and_run(argc, argv); });
}

}  // namespace modar
