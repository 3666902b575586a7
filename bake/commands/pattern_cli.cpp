// The command line of `modar pattern`, told to CLI11 and taken from it as plain structs.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include "bake/commands/arguments.hpp"
#include "bake/commands/commands.hpp"
#include "bake/pattern/pattern_picture.hpp"
#include "bake/terminal.hpp"

namespace modar {
namespace {

CLI::App* add_rectify(CLI::App& app, RectifyCommand& rectify, std::string& corners) {
  CLI::App* sub = app.add_subcommand("rectify", "A frontal picture from a photo and four corners");
  sub->add_option("photo", rectify.photo, "The photo")->required()->type_name("PHOTO");
  sub->add_option("--corners", corners,
                  "Pixels of the top-left, top-right, bottom-right and bottom-left corner")
      ->required()
      ->type_name("x,y,x,y,x,y,x,y");
  sub->add_option("--width-mm", rectify.options.width_mm, "Physical width of the thing")
      ->check(CLI::PositiveNumber);
  sub->add_option("--height-mm", rectify.options.height_mm,
                  "Physical height; without it the aspect ratio comes from the perspective")
      ->check(CLI::PositiveNumber);
  sub->add_option("--max-side", rectify.options.max_side, "Longest side of the result, in pixels")
      ->check(CLI::Range(16u, kMaxTextureSide))
      ->capture_default_str();
  sub->add_option("-o,--output", rectify.output, "The PNG to write")
      ->required()
      ->type_name("IMAGE");
  sub->add_flag("--json", rectify.json, "Print the image's size as JSON");
  sub->footer(
      example("  modar pattern rectify photo.jpg --corners 212,80,905,131,870,640,190,602"
              " --width-mm 210 -o cover.png\n"));
  return sub;
}

CLI::App* add_score(CLI::App& app, ScoreCommand& score) {
  CLI::App* sub =
      app.add_subcommand("score", "0 to 100: how well pictures serve as patterns, and what to do");
  sub->add_option("patterns", score.patterns, "Pattern pictures, or folders of them")
      ->required()
      ->type_name("IMAGE|DIR...");
  sub->add_option(
         "--overlay", score.overlay_folder,
         "Write NAME.png of each: features that hold (green), that hold at times (orange), "
         "places without any (dark)")
      ->type_name("DIR");
  sub->add_option("--jobs", score.jobs, "Threads; the scores do not depend on it")
      ->check(CLI::Range(1u, 256u));
  sub->add_flag("--json", score.json, "Print as JSON");
  sub->footer(example("  modar pattern score cover.png --overlay overlays\n"));
  return sub;
}

CLI::App* add_simulate(CLI::App& app, SimulateCommand& simulate) {
  CLI::App* sub = app.add_subcommand(
      "simulate", "How far, tilted, dark, blurred or covered a pattern may be: the device's loop");
  sub->add_option("patterns", simulate.patterns, "Pattern pictures, or folders of them")
      ->required()
      ->type_name("IMAGE|DIR...");
  sub->add_option("--camera", simulate.camera_file,
                  "Calibration of the camera (OpenCV's YML): intrinsics and resolution")
      ->type_name("FILE");
  sub->add_option("--backgrounds", simulate.backgrounds,
                  "A folder of photos without the pattern; else made ones")
      ->type_name("DIR");
  sub->add_option("--width-mm", simulate.options.width_mm, "Printed width of the pattern")
      ->check(CLI::PositiveNumber);
  sub->add_option("--views", simulate.options.views, "Views of each value of a band")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  sub->add_option("--seed", simulate.options.seed, "Of the views")->capture_default_str();
  sub->add_option("--picture", simulate.picture_folder,
                  "Write a contact sheet NAME.png of each pattern's views")
      ->type_name("DIR");
  sub->add_option("--jobs", simulate.options.jobs, "Threads; the figures do not depend on it")
      ->check(CLI::Range(1u, 256u));
  sub->add_flag("--quiet", simulate.quiet, "No progress bar");
  sub->add_flag("--json", simulate.json, "Print the figures as JSON");
  sub->footer(
      example("  modar pattern simulate cover.png --width-mm 200 --camera phone.yml"
              " --picture sheets\n"));
  return sub;
}

CLI::App* add_confusion(CLI::App& app, ConfusionCommand& confusion) {
  CLI::App* sub = app.add_subcommand(
      "confusion", "Is a pattern taken for another, or seen in photos without it?");
  sub->add_option("inputs", confusion.inputs,
                  "Bundles, pattern pictures and folders of them: all of a project")
      ->required()
      ->type_name("BUNDLE|IMAGE|DIR...");
  sub->add_option("--backgrounds", confusion.photos, "A folder of photos without a pattern")
      ->type_name("DIR");
  sub->add_option("--views", confusion.options.views, "Of each pattern and photo")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  sub->add_option("--seed", confusion.options.seed, "Of the views")->capture_default_str();
  sub->add_option("--jobs", confusion.options.jobs, "Threads; the counts do not depend on it")
      ->check(CLI::Range(1u, 256u));
  sub->add_flag("--quiet", confusion.quiet, "No progress bar");
  sub->add_flag("--json", confusion.json, "Print the counts as JSON");
  sub->footer(example("  modar pattern confusion museum.modar --backgrounds photos\n") +
              "Answers 3 where a pattern is recognised that is not there.\n");
  return sub;
}

int rectify_from_texts(RectifyCommand& rectify, const std::string& corners) {
  const Result<std::array<PixelPoint, 4>> parsed = parse_corners(corners);
  if (!parsed) return print_error(parsed.error());
  rectify.options.corners = *parsed;
  return run_rectify(rectify);
}

}  // namespace

int run_pattern(std::vector<std::string> arguments) {
  CLI::App app("modar pattern: pictures of flat things, before they are baked", "modar pattern");
  app.require_subcommand(1);
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  RectifyCommand rectify;
  std::string corners;
  ScoreCommand score;
  SimulateCommand simulate;
  ConfusionCommand confusion;
  score.jobs = simulate.options.jobs = confusion.options.jobs = cores;
  const CLI::App* rectify_sub = add_rectify(app, rectify, corners);
  const CLI::App* score_sub = add_score(app, score);
  const CLI::App* simulate_sub = add_simulate(app, simulate);
  const CLI::App* confusion_sub = add_confusion(app, confusion);
  try {
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? static_cast<int>(ExitCode::kOk)
                                : static_cast<int>(ExitCode::kUsage);
  }
  for (std::vector<std::string>* inputs :
       {&score.patterns, &simulate.patterns, &confusion.inputs}) {
    if (auto done = open_folders(*inputs); !done) return print_error(done.error());
  }
  if (rectify_sub->parsed()) return rectify_from_texts(rectify, corners);
  if (score_sub->parsed()) return run_score(score);
  if (confusion_sub->parsed()) return run_confusion(confusion);
  if (simulate_sub->parsed()) return run_simulate(simulate);
  return static_cast<int>(ExitCode::kUsage);
}

}  // namespace modar
