// `modar pattern`: rectify, score, simulate and confusion, one after the other.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/bundle/bundle_json.hpp"
#include "bake/bundle/files/sorted_files.hpp"
#include "bake/commands/commands.hpp"
#include "bake/io/output.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"
#include "bake/options/request_text.hpp"
#include "bake/pattern/pattern.hpp"
#include "formats/base/path.hpp"
#include "modar/camera_file.hpp"

namespace modar {
namespace {

struct RectifyCommand {
  std::string photo;
  std::string corners;  ///< empty: they are looked for
  std::string picture;  // /< of the corners that were found; empty: next to the output
  std::string width;    ///< with a unit, as is the height
  std::string height;
  RectifyOptions options;
  std::string output;
  bool doubtful = false;  ///< the corners that were found
  bool json = false;
};

/// A measurement of each of some pictures.
struct PicturesCommand {
  std::vector<std::string> patterns;  ///< image files
  std::string picture_folder;         ///< with the measurement drawn; empty: none
  std::string shape;                  ///< of parse_shape(); empty: flat
  bool json = false;
};

struct ScoreCommand : PicturesCommand {
  unsigned jobs = 1;  ///< threads; the scores do not depend on it
};

struct NamedScore {
  std::string name;
  PatternScore score;
  double width_mm = 0;  ///< that the file states; 0: none
};

struct ConfusionCommand {
  std::vector<std::string> inputs;  ///< bundles and image files
  std::string photos;               ///< folder; empty: none
  ConfusionOptions options;
  bool quiet = false;
  bool json = false;
};

struct SimulateCommand : PicturesCommand {
  std::string camera_file;  ///< empty: the default camera
  std::string backgrounds;  ///< folder; empty: made ones
  std::string width;        ///< with a unit
  SimulateOptions options;
  bool quiet = false;
};

unsigned cores() {
  return std::max(1u, std::thread::hardware_concurrency());
}

/// As --corners takes them.
std::string corners_text(const std::array<PixelPoint, 4>& corners) {
  std::string text;
  for (const PixelPoint& corner : corners) {
    char one[64];
    std::snprintf(one, sizeof one, "%s%.1f,%.1f", text.empty() ? "" : ",", corner.x, corner.y);
    text += one;
  }
  return text;
}

Json corners_json(const std::array<PixelPoint, 4>& corners) {
  return Json::list(corners, [&](const PixelPoint& corner) {
    return Json::array({corner.x, corner.y});
  });
}

Result<void> take_length(const char* option, const std::string& text, double& mm) {
  if (text.empty()) return {};
  const auto length = parse_millimetres(text);
  if (!length) {
    return fail(ExitCode::kUsage, "cli.length", option + (" " + text), length.error().cause,
                length.error().cure);
  }
  mm = *length;
  return {};
}

/// The corners of --corners, or those that are found, shown in a picture.
Result<void> take_corners(RectifyCommand& command, const RgbaImage& photo) {
  if (!command.corners.empty()) {
    MODAR_ASSIGN(command.options.corners, parse_corners(command.corners));
    return {};
  }
  MODAR_ASSIGN(const FoundCorners found, find_corners(photo));
  command.options.corners = found.corners;
  if (command.picture.empty()) {
    command.picture = command.output.substr(0, command.output.size() - 4) + ".corners.png";
  }
  MODAR_TRY(keep_inputs(command.picture, {command.photo, command.output}));
  MODAR_ASSIGN(const RgbaImage picture, corners_picture(photo, found.corners));
  MODAR_TRY(write_png(picture, command.picture));
  std::fprintf(stderr, "found the corners %s, see %s; if they are wrong, pass --corners\n",
               corners_text(found.corners).c_str(), command.picture.c_str());
  command.doubtful = *found.doubt() != 0;
  if (command.doubtful) {
    print_diagnostic({"rectify.doubtful", DiagnosticSeverity::kWarning, command.photo, 0,
                      "the corners may be wrong: " + std::string(doubt_words(found.doubt())),
                      "look at " + command.picture + ", and pass the right ones with --corners"});
  }
  return {};
}

/// Warns of sizes that the photo contradicts: typing errors, or both sizes exchanged.
void print_contradiction(const RectifyCommand& command, const Rectified& done) {
  // Share that is more than what paper shrinks by or a hand measures wrong. [0.1, 0.3]
  constexpr double kContradicts = 0.2;
  const double off = std::abs(std::log(done.aspect.aspect / done.seen.aspect));
  const double unsure = done.seen.spread / done.seen.aspect;
  if (done.aspect.spread > 0 || off < kContradicts + 3 * unsure) return;
  char cause[128];
  std::snprintf(cause, sizeof cause,
                "--width by --height is %.3f, but the photo shows %.3f +- %.3f", done.aspect.aspect,
                done.seen.aspect, done.seen.spread);
  print_diagnostic({"rectify.sizes", DiagnosticSeverity::kWarning, command.photo, 0, cause,
                    "measure both sides again; the width is that of the upper edge"});
}

/// The output, and how well its shape is known.
void print_rectified(const RectifyCommand& command, const Rectified& done) {
  // The player measures aspects that are off by less as soon as it sees the thing.
  constexpr double kWellKnown = 0.02;
  const AspectEstimate& aspect = done.aspect;
  std::fprintf(stderr, "wrote %s, %u x %u pixels", command.output.c_str(), done.image.width,
               done.image.height);
  if (aspect.spread > 0) {
    std::fprintf(stderr, "; width by height %.3f +- %.3f", aspect.aspect, aspect.spread);
  }
  std::fputc('\n', stderr);
  if (aspect.spread < kWellKnown * aspect.aspect) return;
  char cause[96];
  std::snprintf(cause, sizeof cause,
                "the side lengths are estimated from perspective, with an uncertainty of %.0f %%",
                100 * aspect.spread / aspect.aspect);
  print_diagnostic({"rectify.aspect", DiagnosticSeverity::kWarning, command.photo, 0, cause,
                    command.options.width_mm > 0
                        ? "measure the height, and give --height"
                        : "measure the sides and give --width and --height, or take a frontal "
                          "photo"});
}

Result<ExitCode> run_rectify(RectifyCommand& command) {
  if (!command.corners.empty()) MODAR_TRY(parse_corners(command.corners));
  MODAR_TRY(take_length("--width", command.width, command.options.width_mm));
  MODAR_TRY(take_length("--height", command.height, command.options.height_mm));
  MODAR_TRY(keep_inputs(command.output, {command.photo}));
  if (!command.output.ends_with(".png") && !command.output.ends_with(".PNG")) {
    return fail(ExitCode::kUsage, "rectify.format", command.output,
                "the picture and its width are written as PNG", "name it FILE.png");
  }
  MODAR_TRY(try_output(command.output, 0));
  MODAR_ASSIGN(const Photo photo, read_photo(command.photo));
  command.options.focal_px = photo.focal_px;
  auto done = take_corners(command, photo.image).and_then([&] {
    return rectify(photo.image, command.options);
  });
  if (!done) {
    Error error = done.error();
    if (error.where.empty()) error.where = command.photo;
    return tl::unexpected(std::move(error));
  }
  MODAR_TRY(write_png(done->image, command.output, command.options.width_mm));
  print_rectified(command, *done);
  print_contradiction(command, *done);
  if (command.json) {
    const Json json = {{"image", command.output},
                       {"width", done->image.width},
                       {"height", done->image.height},
                       {"aspect", done->aspect.aspect},
                       {"aspect_spread", done->aspect.spread},
                       {"corners", corners_json(command.options.corners)},
                       {"doubtful", command.doubtful},
                       {"width_mm", command.options.width_mm}};
    std::fputs(json.dump().c_str(), stdout);
  }
  return ExitCode::kOk;
}

void add_rectify(CommandLine& pattern) {
  CommandLine& line =
      pattern.command("rectify", "Make a frontal picture of a flat thing from a photo");
  const auto command = std::make_shared<RectifyCommand>();
  line.option("photo", &command->photo, "The photo", {.type = "PHOTO", .required = true});
  line.option(
      "--corners", &command->corners,
      "Pixels of the top-left, top-right, bottom-right and bottom-left corner (default: they "
      "are detected, and a picture shows them)",
      {.type = "x,y,x,y,x,y,x,y"});
  line.option("--picture", &command->picture,
              "Picture of the detected corners (default: OUTPUT.corners.png)",
              {.type = "FILE", .excludes = "--corners"});
  line.option("--width", &command->width, "Physical width of the thing, as in 210mm",
              {.type = "LENGTH"});
  line.option("--height", &command->height,
              "Physical height (default: estimated from the perspective, with its uncertainty)",
              {.type = "LENGTH"});
  line.option("--max-side", &command->options.max_side, "Longest side of the result, in pixels",
              {.shows_default = true, .least = 16, .most = kMaxTextureSide});
  line.option("-o,--output", &command->output, "PNG file to write",
              {.type = "IMAGE", .required = true});
  line.flag("--json", command->json, "Print size, aspect and corners as JSON");
  line.footer(
      example("  modar pattern rectify photo.jpg --width 210mm -o cover.png\n"
              "  modar pattern rectify photo.jpg --corners 212,80,905,131,870,640,190,602"
              " --width 210mm -o cover.png\n"));
  line.run([command] { return run_rectify(*command); });
}

/// In place of the document of a file that failed.
Json failure_json(const std::string& path, const Error& error) {
  return {{"name", file_stem(path)}, {"error", to_line(error)}};
}

Json score_json(const NamedScore& one) {
  const Json causes = Json::list(one.score.causes, [&](const ScoreCause& cause) -> Json {
    return {{"id", cause.id}, {"value", cause.value}, {"advice", cause.advice}};
  });
  return {{"name", one.name},
          {"score", one.score.score},
          {"version", kScoreVersion},
          {"grade", std::string(1, one.score.grade)},
          {"range", range_json(one.score.range, one.width_mm)},
          {"causes", causes}};
}

/// Where a file's picture goes; the file itself is not overwritten.
Result<std::string> picture_of(const std::string& path, const std::string& folder) {
  std::string out = folder + "/" + file_stem(path) + ".png";
  MODAR_TRY(keep_inputs(out, {path}));
  return out;
}

/// Prints the fault of one file, after which the others continue; the first such error is what
/// the command answers.
void print_failure(const Error& error, ExitCode& answer) {
  print_error(error);
  if (answer == ExitCode::kOk) answer = error.exit;
}

/// Measures each picture, and prints it as text, or all as JSON.
template <class Measure, class Print, class Make>
Result<ExitCode> measure_each(PicturesCommand& command, const Measure& measure, const Print& print,
                              const Make& json_of) {
  MODAR_TRY(open_folders(command.patterns));
  if (!command.picture_folder.empty()) {
    MODAR_TRY(make_output_folder(command.picture_folder));
    for (const std::string& path : command.patterns) {
      MODAR_TRY(picture_of(path, command.picture_folder));
    }
  }
  ExitCode answer = ExitCode::kOk;
  Json list = Json::array();
  for (const std::string& path : command.patterns) {
    const auto one = measure(path);
    if (!one) {
      print_failure(one.error(), answer);
      list.push_back(failure_json(path, one.error()));
      continue;
    }
    if (!command.json) print(*one);
    list.push_back(json_of(*one));
  }
  if (command.json) std::fputs(list.dump().c_str(), stdout);
  return answer;
}

Result<NamedScore> score_named(const ScoreCommand& command, const std::string& path) {
  MODAR_ASSIGN(const ShapeRequest shape, shape_of(path, command.shape));
  MODAR_ASSIGN(ScoredPicture scored, score_file(path, 0, shape, command.jobs));
  if (!command.picture_folder.empty()) {
    MODAR_ASSIGN(const std::string out, picture_of(path, command.picture_folder));
    MODAR_TRY(write_png(score_overlay(scored.shaped.picture.view(), scored.score), out));
  }
  return NamedScore{file_stem(path), std::move(scored.score), scored.shaped.width_mm};
}

void print_score(const NamedScore& one) {
  std::printf("%s: %c: %s; %d of 100 (version %u)\n", one.name.c_str(), one.score.grade,
              range_sentence(one.score.range, one.width_mm).c_str(), one.score.score,
              kScoreVersion);
  for (const ScoreCause& cause : one.score.causes) {
    std::printf("  %-10s %3d%s%s\n", cause.id, cause.value, *cause.advice != 0 ? "  " : "",
                cause.advice);
  }
}

void add_score(CommandLine& pattern) {
  CommandLine& line = pattern.command(
      "score", "Grade pictures as patterns, A to E, with their working range and advice");
  const auto command = std::make_shared<ScoreCommand>();
  command->jobs = cores();
  line.option("patterns", &command->patterns, "Pattern pictures, or folders of them",
              {.type = "IMAGE|DIR...", .required = true});
  line.option("--overlay", &command->picture_folder,
              "Write NAME.png for each: robust features (green), weak features (orange), areas "
              "without features (dark)",
              {.type = "DIR"});
  line.option("--shape", &command->shape,
              "Surface that it is printed on, as for `modar pattern simulate`", {.type = "SHAPE"});
  line.option("--jobs", &command->jobs, "Threads; the scores do not depend on it",
              {.least = 1, .most = 256});
  line.flag("--json", command->json, "Print as JSON");
  line.footer(example("  modar pattern score cover.png --overlay overlays\n"));
  line.run([command] {
    const auto score = [&](const std::string& path) { return score_named(*command, path); };
    return measure_each(*command, score, print_score, score_json);
  });
}

Json value_json(const SimulatedValue& value) {
  const PoseFigures& row = value.outcome.figures;
  return {{"value", value.value},
          {"frames", row.frames},
          {"recognised_pct", 100.0 * row.recognised / row.frames},
          {"right_pct", 100.0 * row.right / row.frames},
          {"error_px", row.error_px},
          {"jitter_px", row.jitter_px}};
}

Json simulation_json(const Simulation& simulation) {
  Json bands = Json::array();
  for (const SimulatedBand& band : simulation.bands) {
    const Json values = Json::list(band.values, value_json);
    bands.push_back({{"name", band.name}, {"unit", band.unit}, {"values", values}});
  }
  const double width = simulation.width_mm;
  return {{"name", simulation.name},
          {"width_mm", width},
          {"nearest_widths", simulation.range.nearest},
          {"farthest_widths", simulation.range.farthest},
          {"nearest_mm", width > 0 ? Json(simulation.range.nearest * width) : Json()},
          {"farthest_mm", width > 0 ? Json(simulation.range.farthest * width) : Json()},
          {"tilt_deg", simulation.range.tilt_deg},
          {"around_deg", simulation.curved ? Json(2 * simulation.range.around_deg) : Json()},
          {"sentence", range_sentence(simulation)},
          {"bands", bands}};
}

void print_simulation(const Simulation& simulation) {
  std::printf("%s: %s\n", simulation.name.c_str(), range_sentence(simulation).c_str());
  std::printf("  %-10s %10s %-11s %8s %8s %10s %10s\n", "band", "value", "", "found %", "right %",
              "error px", "jitter px");
  for (const SimulatedBand& band : simulation.bands) {
    for (const SimulatedValue& value : band.values) {
      const PoseFigures& row = value.outcome.figures;
      std::printf("  %-10s %10.3g %-11s %8.1f %8.1f %10.3f %10.3f\n", band.name.c_str(),
                  value.value, band.unit.c_str(), 100.0 * row.recognised / row.frames,
                  100.0 * row.right / row.frames, row.error_px, row.jitter_px);
    }
  }
}

/// Options that are files, read.
Result<void> complete(SimulateCommand& command) {
  if (!command.camera_file.empty()) {
    MODAR_ASSIGN(command.options.camera, read_camera_file(command.camera_file));
  }
  if (!command.backgrounds.empty()) {
    MODAR_ASSIGN(command.options.backgrounds, pictures_of(command.backgrounds));
  }
  return {};
}

Result<Simulation> simulate_file(SimulateCommand& command, const std::string& path,
                                 ProgressBar& bar) {
  MODAR_ASSIGN(command.options.shape, shape_of(path, command.shape));
  MODAR_ASSIGN(Simulation simulation,
               simulate(path, command.options,
                        [&](const std::string&, double done) { bar.show(file_stem(path), done); }));
  if (!command.picture_folder.empty()) {
    MODAR_ASSIGN(const std::string out, picture_of(path, command.picture_folder));
    MODAR_TRY(write_png(simulation_picture(simulation), out));
  }
  return simulation;
}

Result<ExitCode> run_simulate(SimulateCommand& command) {
  MODAR_TRY(take_length("--width", command.width, command.options.width_mm));
  MODAR_TRY(complete(command));
  ProgressBar bar(command.quiet);
  const auto simulated = [&](const std::string& path) {
    auto simulation = simulate_file(command, path, bar);
    bar.clear();
    return simulation;
  };
  return measure_each(command, simulated, print_simulation, simulation_json);
}

void add_simulate(CommandLine& pattern) {
  CommandLine& line = pattern.command(
      "simulate", "Measure how far, tilted, dark, blurred or covered a pattern may be");
  const auto command = std::make_shared<SimulateCommand>();
  SimulateOptions& options = command->options;
  options.jobs = cores();
  line.option("patterns", &command->patterns, "Pattern pictures, or folders of them",
              {.type = "IMAGE|DIR...", .required = true});
  line.option("--camera", &command->camera_file,
              "Camera file (OpenCV's YML): intrinsics and resolution", {.type = "FILE"});
  line.option("--backgrounds", &command->backgrounds,
              "Folder of photos without the pattern (default: generated ones)", {.type = "DIR"});
  line.option("--width", &command->width, "Printed width of the pattern, as in 210mm",
              {.type = "LENGTH"});
  line.option(
      "--shape", &command->shape,
      "Surface that it is printed on: cylinder,diameter=66mm,arc=120 or cone,top=80mm,bottom=60mm,"
      "arc=100, or a box as in bake --pattern",
      {.type = "SHAPE"});
  line.option("--views", &options.views, "Views per value",
              {.shows_default = true, .least = 1, .most = 1000});
  line.option("--seed", &options.seed, "Random seed of the views", {.shows_default = true});
  line.option("--picture", &command->picture_folder,
              "Write a contact sheet of the views, NAME.png, for each pattern", {.type = "DIR"});
  line.option("--jobs", &options.jobs, "Threads; the figures do not depend on it",
              {.least = 1, .most = 256});
  line.flag("--quiet", command->quiet, "No progress bar");
  line.flag("--json", command->json, "Print the figures as JSON");
  line.footer(
      example("  modar pattern simulate cover.png --width 200mm --camera phone.yml"
              " --picture sheets\n"));
  line.run([command] { return run_simulate(*command); });
}

Json confusion_json(const Confusion& confusion) {
  const std::size_t count = confusion.names.size();
  Json patterns = Json::array();
  for (std::size_t shown = 0; shown < count; ++shown) {
    Json taken_for = Json::object();
    for (std::size_t asked = 0; asked < count; ++asked) {
      const int times = confusion.recognised[shown * count + asked];
      if (asked != shown && times > 0) taken_for.set(confusion.names[asked], times);
    }
    patterns.push_back({{"name", confusion.names[shown]},
                        {"recognised", confusion.recognised[shown * count + shown]},
                        {"taken_for", taken_for},
                        {"mirrored", confusion.mirrored[shown]},
                        {"in_photos", confusion.in_photos[shown]}});
  }
  const Json keep_apart = Json::list(confusion.alike_pairs(), [&](const AlikePair& pair) {
    return Json{{"a", confusion.names[pair.a]},
                {"b", confusion.names[pair.b]},
                {"told_apart", pair.told_apart}};
  });
  return {{"views", confusion.views},
          {"photo_views", confusion.photo_views},
          {"false_recognitions", confusion.false_recognitions()},
          {"false_together", confusion.false_together()},
          {"keep_apart", keep_apart},
          {"patterns", patterns}};
}

void print_confusion(const Confusion& confusion) {
  const std::size_t count = confusion.names.size();
  std::printf("%-24s %14s %14s  %s\n", "shown", "recognised", "in photos", "mistaken for");
  for (std::size_t shown = 0; shown < count; ++shown) {
    std::printf("%-24s %7d of %3d %7d of %3d  ", confusion.names[shown].c_str(),
                confusion.recognised[shown * count + shown], confusion.views,
                confusion.in_photos[shown], confusion.photo_views);
    for (std::size_t asked = 0; asked < count; ++asked) {
      const int times = confusion.recognised[shown * count + asked];
      if (asked != shown && times > 0) {
        std::printf("%s (%d) ", confusion.names[asked].c_str(), times);
      }
    }
    std::printf("\n");
  }
  for (const AlikePair& pair : confusion.alike_pairs()) {
    std::printf(
        "%s: %s and %s\n",
        pair.told_apart ? "bake into one bundle, where they are distinguished" : "keep apart",
        confusion.names[pair.a].c_str(), confusion.names[pair.b].c_str());
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (confusion.mirrored[i] == 0) continue;
    std::printf("%s is recognised in its mirror image (%d of %d)\n", confusion.names[i].c_str(),
                confusion.mirrored[i], confusion.views);
  }
  std::printf("false recognitions: %d with one pattern at a time, %d with all in one bundle\n",
              confusion.false_recognitions(), confusion.false_together());
}

Result<ExitCode> run_confusion(ConfusionCommand& command) {
  MODAR_TRY(open_folders(command.inputs));
  if (!command.photos.empty()) {
    MODAR_ASSIGN(auto photos, pictures_of(command.photos));
    command.options.photos = std::move(photos);
  }
  ExitCode answer = ExitCode::kOk;
  std::vector<NamedPattern> patterns;
  for (const std::string& input : command.inputs) {
    auto some = shape_of(input, "").and_then([&](const ShapeRequest& shape) {
      return read_patterns(input, shape, command.options.jobs);
    });
    if (!some) print_failure(some.error(), answer);
    if (some) std::move(some->begin(), some->end(), std::back_inserter(patterns));
  }
  if (patterns.empty()) return answer;
  ProgressBar bar(command.quiet);
  const auto confusion =
      measure_confusion(patterns, command.options,
                        [&](const std::string& what, double done) { bar.show(what, done); });
  bar.clear();
  if (!confusion) return tl::unexpected(confusion.error());
  if (command.json) {
    std::fputs(confusion_json(*confusion).dump().c_str(), stdout);
  } else {
    print_confusion(*confusion);
  }
  return confusion->false_recognitions() == 0 ? answer : ExitCode::kInvalidInput;
}

void add_confusion(CommandLine& pattern) {
  CommandLine& line = pattern.command(
      "confusion",
      "Find patterns that are mistaken for each other, or seen in photos without them");
  const auto command = std::make_shared<ConfusionCommand>();
  ConfusionOptions& options = command->options;
  options.jobs = cores();
  line.option("inputs", &command->inputs,
              "Bundles, pattern pictures and folders of them: all patterns of a project",
              {.type = "BUNDLE|IMAGE|DIR...", .required = true});
  line.option("--backgrounds", &command->photos, "Folder of photos without a pattern",
              {.type = "DIR"});
  line.option("--views", &options.views, "Views per pattern and photo",
              {.shows_default = true, .least = 1, .most = 10000});
  line.option("--seed", &options.seed, "Random seed of the views", {.shows_default = true});
  line.option("--jobs", &options.jobs, "Threads; the counts do not depend on it",
              {.least = 1, .most = 256});
  line.flag("--quiet", command->quiet, "No progress bar");
  line.flag("--json", command->json, "Print the counts as JSON");
  line.footer(example("  modar pattern confusion museum.modar --backgrounds photos\n") +
              "Exits with 3 if a pattern is recognised that is not there.\n");
  line.run([command] { return run_confusion(*command); });
}

}  // namespace

Result<ShapeRequest> shape_of(const std::string& path, const std::string& told) {
  if (!told.empty()) return parse_shape(told);
  PatternRequest pattern{path};
  std::vector<Diagnostic> said;
  MODAR_TRY(find_picture(pattern, said));
  for (const Diagnostic& one : said) print_diagnostic(one);
  return std::move(pattern.shape);
}

void add_pattern(CommandLine& program) {
  CommandLine& line = program.command(
      "pattern", "Prepare and measure patterns: rectify, score, simulate, confusion");
  add_rectify(line);
  add_score(line);
  add_simulate(line);
  add_confusion(line);
}

}  // namespace modar
