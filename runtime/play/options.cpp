#include "options.hpp"

#include <array>
#include <vector>

#include "decimal.hpp"
#include "formats/layout.hpp"
#include "runtime/platform/command_line.hpp"

namespace modar {
namespace {

tl::unexpected<Error> usage(const char* code, std::string where, std::string cause) {
  return fail(ExitCode::kUsage, code, std::move(where), std::move(cause), "see modar-play --help");
}

bool set_size(PlayOptions& options, std::string_view text) {
  constexpr int kMaxSide = 8192;  // what current GPUs draw; refuses typing errors
  const std::size_t x = text.find('x');
  if (x == std::string_view::npos) return false;
  options.width = static_cast<int>(parse_count(text.substr(0, x), kMaxSide));
  options.height = static_cast<int>(parse_count(text.substr(x + 1), kMaxSide));
  return options.width > 0 && options.height > 0;
}

bool set_turntable(PlayOptions& options, std::string_view text) {
  options.turntable = static_cast<int>(parse_count(text, 100'000));
  return options.turntable > 0;
}

bool set_tolerance(PlayOptions& options, std::string_view text) {
  return parse_decimal(text, options.tolerance);
}

bool set_smooth(PlayOptions& options, std::string_view text) {
  return parse_decimal(text, options.smooth_ms) && options.smooth_ms >= 0.0 &&
         options.smooth_ms <= 1000.0;
}

bool set_gpu_budget(PlayOptions& options, std::string_view text) {
  options.gpu_budget = parse_bytes(text);
  return options.gpu_budget > 0;
}

bool set_copies(PlayOptions& options, std::string_view text) {
  options.copies = static_cast<int>(parse_count(text, kMaxCopies));
  return options.copies > 0;
}

struct TextOption {
  const char* name;
  std::string PlayOptions::*text;
};
constexpr std::array<TextOption, 11> kTexts = {{{"input", &PlayOptions::input},
                                                {"out", &PlayOptions::out},
                                                {"report", &PlayOptions::report},
                                                {"record", &PlayOptions::record},
                                                {"golden", &PlayOptions::golden},
                                                {"qos", &PlayOptions::qos},
                                                {"camera", &PlayOptions::camera_file},
                                                {"gyro", &PlayOptions::gyro},
                                                {"method", &PlayOptions::method},
                                                {"parameters", &PlayOptions::parameters},
                                                {"device", &PlayOptions::device}}};

struct ValueOption {
  const char* name;
  bool (*set)(PlayOptions&, std::string_view);
  const char* expected;
};
constexpr std::array<ValueOption, 6> kValues = {{
    {"turntable", set_turntable, "a number of frames (1 to 100000)"},
    {"size", set_size, "a size like 640x480"},
    {"tolerance", set_tolerance, "a number of pixels like 0.5"},
    {"smooth", set_smooth, "a number of milliseconds (0 to 1000)"},
    {"gpu-budget", set_gpu_budget, "an amount of memory like 64M"},
    {"copies", set_copies, "a number of copies (1 to 16)"},
}};

struct SwitchOption {
  const char* name;
  bool PlayOptions::*on;
};
constexpr std::array<SwitchOption, 16> kSwitches = {
    {{"json", &PlayOptions::json},
     {"extended", &PlayOptions::extended},
     {"homography", &PlayOptions::homography},
     {"force", &PlayOptions::force},
     {"window", &PlayOptions::window},
     {"realtime", &PlayOptions::realtime},
     {"live", &PlayOptions::live},
     {"outline", &PlayOptions::outline},
     {"osd", &PlayOptions::osd},
     {"no-light-estimate", &PlayOptions::no_light_estimate},
     {"sound", &PlayOptions::sound},
     {"quiet", &PlayOptions::quiet},
     {"verify", &PlayOptions::verify},
     {"help", &PlayOptions::help},
     {"help-all", &PlayOptions::help_all},
     {"version", &PlayOptions::version}}};

/// All options, in the order of the three tables.
std::vector<CommandOption> all_options() {
  std::vector<CommandOption> all;
  for (const TextOption& each : kTexts) all.push_back({each.name, "a text"});
  for (const ValueOption& each : kValues) all.push_back({each.name, each.expected});
  for (const SwitchOption& each : kSwitches) all.push_back({each.name});
  return all;
}

/// Takes option number `index` of all_options(); false where its value is invalid.
bool take(PlayOptions& options, std::size_t index, std::string_view value) {
  if (index < kTexts.size()) {
    options.*kTexts[index].text = value;
    return true;
  }
  index -= kTexts.size();
  if (index < kValues.size()) return kValues[index].set(options, value);
  options.*kSwitches[index - kValues.size()].on = true;
  return true;
}

Result<void> validate(const PlayOptions& options) {
  if (options.help || options.help_all || options.version) return {};
  if (options.bundle.empty()) return usage("usage.bundle", "", "no bundle is given");
  if (options.input.empty() && options.golden.empty() && options.turntable == 0) {
    return usage("usage.input", "", "none of --input, --golden and --turntable is given");
  }
  const int things = (options.input.empty() ? 0 : 1) + (options.golden.empty() ? 0 : 1) +
                     (options.turntable > 0 ? 1 : 0);
  if (things > 1) {
    return usage("usage.conflict", "", "--input, --golden and --turntable exclude each other");
  }
  if (options.turntable > 0 && options.out.empty()) {
    return usage("usage.out", "--turntable", "--out is missing, the pictures have no place to go");
  }
  if (!options.golden.empty() && (options.realtime || !options.record.empty())) {
    return usage("usage.conflict", "--golden", "it replays every frame, and records none");
  }
  if (options.live &&
      !(options.golden.empty() && options.record.empty() && options.turntable == 0)) {
    return usage("usage.conflict", "--live", "recordings and turntables are of one bundle");
  }
  if (options.copies > 1 && !(options.golden.empty() && options.record.empty())) {
    return usage("usage.conflict", "--copies", "recordings are of one copy of each pattern");
  }
  if (!options.gyro.empty() && !options.extended) {
    return usage("usage.conflict", "--gyro", "it has no effect without --extended");
  }
  if (!options.method.empty() && options.method != "ours" && options.method != "paper") {
    return usage("usage.method", "--method",
                 "'" + options.method + "' is not a method; use 'ours' or 'paper'");
  }
  if (options.method == "ours" && !options.parameters.empty()) {
    return usage("usage.conflict", "--parameters", "the sets are those of --method paper");
  }
  return {};
}

}  // namespace

std::uint64_t parse_bytes(std::string_view text) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 40;
  unsigned shift = 0;
  if (text.ends_with('K')) shift = 10;
  if (text.ends_with('M')) shift = 20;
  if (text.ends_with('G')) shift = 30;
  if (shift > 0) text.remove_suffix(1);
  return parse_count(text, kMost >> shift) << shift;
}

Result<PlayOptions> parse_options(std::span<const char* const> arguments) {
  const std::vector<CommandOption> table = all_options();
  PlayOptions options;
  MODAR_ASSIGN(const auto rest,
               parse_command_line(arguments, {"usage", "see modar-play --help", table},
                                  [&](std::size_t index, std::string_view value) {
                                    return take(options, index, value);
                                  }));
  for (const std::string& argument : rest) {
    if (!options.bundle.empty()) {
      return usage("usage.argument", "", "'" + argument + "' is an unexpected argument");
    }
    options.bundle = argument;
  }
  MODAR_TRY(validate(options));
  if (!(options.golden.empty() && options.record.empty())) options.copies = 1;
  return options;
}

std::string help_text(bool all) {
  // The usual options, then the others, then what follows either.
  constexpr const char* kUsual = R"(modar-play: plays a bundle over a video, pictures or a camera

Usage: modar-play BUNDLE --input VIDEO|IMAGE|FOLDER|camera[:N]|- [options]
       modar-play BUNDLE --turntable N --out FOLDER|FILE.mp4

Input and output:
  --input INPUT       a video, a picture, a folder of pictures (sorted by name; those that cannot
                      be read are skipped), a camera, Y4M (- or FILE.y4m) or raw frames
                      (nv21:640x480@30:FILE, with - for a pipe; also i420, nv12, yuyv, grey)
  --out OUT           write pictures to FILE.mp4, or to a folder as frame_000000.png ...
  --report FOLDER     write overlay.mp4, contact_sheet.png, frames.jsonl and index.html
  --window            show a window; its keys: Q or Escape quits, space pauses, M or the arrows
                      switch the model, P the pattern, + and - its size, O the outline, D the
                      display; S sound, 9 and 0 its volume, C captions; F freezes the picture, and
                      four clicks on the corners of something flat make it the pattern
  --json              print one JSON line per frame and a summary to standard output

Tracking:
  --camera FILE.yml   camera matrix and distortion in OpenCV's format (default: the focal length
                      starts at the frame's longer side and is estimated, as --json reports; see
                      also modar calibrate)
  --extended          learn the static surroundings of a pattern, and continue while the
                      pattern is covered or out of view
  --copies N          track up to N copies of each pattern, each with its content
                      (default: as baked)
  --smooth MS         steady models at rest, which may lag by this much (default: 0, off)
  --outline           draw the outline of each visible pattern (amber while it is extended), the
                      default if no pattern has content
)";
  constexpr const char* kMore =
      R"(  --gyro FILE         with --extended: rotations of the camera, one line per frame with the rotation
                      vector since the frame before, in radians (x right, y down, z forward)
  --homography        add to the JSON lines the map from each pattern's unit square to the frame,
                      for cameras of unknown focal length
  --method METHOD     ours (default if the bundle has records for it) or paper, the ModAR paper's
  --parameters SET    for --method paper, which it implies: orb-2000 (default), orb-500, brisk-3
                      or brisk-2, as baked

Display:
  --no-light-estimate keep the light of models, whatever the camera shows of the patterns
  --osd               draw state, reason and inliers on the pictures
  --device NAME       simulate a device by masking OpenGL ES features that it lacks
  --gpu-budget SIZE   GPU memory limit, nearest and visible models first (64M, 1G)
  --turntable N       render N pictures of each model turning (without models: of pictures
                      and videos), without a camera
  --size WxH          size of the turntable's pictures (default: 640x480)

Running:
  --live              reload the bundle when its file is replaced (see modar bake --watch)
  --realtime          play a file at its own speed, dropping frames
  --sound             with a camera or --realtime: let videos and sounds be heard from the start
  --force             write into a folder of --out or --report that contains other files
  --verify            check every byte of the bundle first, not just its tables
  --quiet             no progress or summary

Recording and field trials:
  --record FOLDER     record frames and poses
  --golden FOLDER     replay a recording and compare: exit code 10 if it differs
  --tolerance PX      with --golden: largest mean distance of the four corners (default: 0.5)
  --qos FILE          write a log with times, found and lost patterns, reasons and memory use
)";
  constexpr const char* kEnd = R"(
Help:
  --help, --help-all  the usual options; all of them
  --version

Example: modar-play spider.modar --input box.mp4 --outline --report out/demo

Exit codes: 0 done (whether or not a pattern was seen), 1 usage, 2 a file cannot be read or
written, 3 invalid input, 4 internal error, 5 not supported by this build or device, 10 --golden
found a difference.
)";
  return std::string(kUsual) + (all ? kMore : "") + kEnd;
}

}  // namespace modar
