// `modar calibrate`: a camera file from a chessboard or any pattern, filmed.
#include <algorithm>
#include <cstdio>
#include <memory>

#include "bake/commands/commands.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"
#include "bake/pattern/pattern.hpp"

namespace modar {
namespace {

struct CalibrateCommand {
  CalibrateOptions options;
  std::string board;  ///< "9x6", empty: none
  std::string output;
  bool quiet = false;
  bool json = false;
};

Json calibration_json(const Calibration& calibration) {
  const Camera& camera = calibration.camera;
  return {{"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"distortion", Json::list(camera.distortion)},
          {"focal_spread", calibration.focal_spread},
          {"principal_point", calibration.principal_point_assumed ? "assumed" : "measured"},
          {"rms_px", calibration.rms_px},
          {"views", calibration.views},
          {"frames", calibration.frames}};
}

/// Options that are texts, read; folders become their pictures.
Result<void> complete(CalibrateCommand& command) {
  CalibrateOptions& options = command.options;
  if (command.board.empty() == options.pattern.empty()) {
    return fail(ExitCode::kUsage, "calibrate.plane", "calibrate",
                "neither a board nor a pattern is given", "give --board 9x6 or --pattern IMAGE");
  }
  char cross = 0;
  char more = 0;
  if (!command.board.empty() &&
      (std::sscanf(command.board.c_str(), "%d%c%d%c", &options.board_columns, &cross,
                   &options.board_rows, &more) != 3 ||
       cross != 'x' || std::min(options.board_columns, options.board_rows) < 3 ||
       std::max(options.board_columns, options.board_rows) > 100)) {
    return fail(ExitCode::kUsage, "calibrate.board", command.board, "this is not a board size",
                "count the inner corners, as in --board 9x6");
  }
  return open_folders(options.inputs);
}

Result<ExitCode> run_calibrate(CalibrateCommand& command) {
  MODAR_TRY(complete(command));
  std::vector<std::string> inputs = command.options.inputs;
  inputs.push_back(command.options.pattern);
  MODAR_TRY(keep_inputs(command.output, inputs));
  MODAR_TRY(keep_other_kinds(command.output, "camera file",
                             [](std::string_view start) { return start.starts_with("%YAML"); }));
  MODAR_TRY(try_output(command.output, 0));
  if (!command.options.pattern.empty()) {
    MODAR_ASSIGN(command.options.shape, shape_of(command.options.pattern, ""));
  }
  ProgressBar bar(command.quiet);
  const auto calibration = calibrate(
      command.options, [&](const std::string& what, double done) { bar.show(what, done); });
  bar.clear();
  if (!calibration) return tl::unexpected(calibration.error());
  MODAR_TRY(write_camera_file(*calibration, command.output));
  if (command.json) {
    std::fputs(calibration_json(*calibration).dump().c_str(), stdout);
  } else {
    const Camera& camera = calibration->camera;
    std::printf(
        "focal length %.2f x %.2f (+- %.2f), centre %.2f, %.2f%s, of %d x %d pixels; %d of %d "
        "frames,"
        " %.3f pixels rms\n",
        camera.fx, camera.fy, calibration->focal_spread, camera.cx, camera.cy,
        calibration->principal_point_assumed ? " (assumed)" : "", camera.width, camera.height,
        calibration->views, calibration->frames, calibration->rms_px);
  }
  return ExitCode::kOk;
}

}  // namespace

void add_calibrate(CommandLine& program) {
  CommandLine& line = program.command(
      "calibrate", "Calibrate a camera from photos or a video of a chessboard or pattern");
  const auto command = std::make_shared<CalibrateCommand>();
  line.option("inputs", &command->options.inputs, "Pictures, folders of pictures, and videos",
              {.type = "VIDEO|IMAGE|DIR...", .required = true});
  line.option("--board", &command->board, "Chessboard with this many inner corners",
              {.type = "COLUMNSxROWS"});
  line.option("--pattern", &command->options.pattern,
              "Use a pattern instead: its picture, or a bundle that has it as its first pattern",
              {.type = "IMAGE|BUNDLE", .excludes = "--board"});
  line.option("--views", &command->options.most_views, "Most views to use",
              {.shows_default = true, .least = 5, .most = 1000});
  line.option("-o,--output", &command->output, "Camera file to write (OpenCV's YML)",
              {.type = "CAMERA.yml", .required = true});
  line.flag("--quiet", command->quiet, "No progress bar");
  line.flag("--json", command->json, "Print the camera as JSON");
  line.footer(
      "\nShow the plane large and sharp, tilted by 30 to 50 degrees to every side.\n"
      "\nExample:\n"
      "  modar calibrate photos --board 9x6 -o phone.yml\n"
      "  modar calibrate walk.mp4 --pattern cover.png -o phone.yml\n"
      "  modar-play vase.modar --input camera --camera phone.yml\n"
      "\nExit codes: 0 ok, 1 wrong usage, 2 a file cannot be read or written, 3 the views are not\n"
      "enough to calibrate, 4 internal error.\n");
  line.run([command] { return run_calibrate(*command); });
}

}  // namespace modar
