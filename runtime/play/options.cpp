// Parses the player's command line with getopt_long: the player links no library for it.
#include "options.hpp"

#include <getopt.h>

#include <array>
#include <charconv>
#include <string_view>
#include <vector>

namespace modar {
namespace {

enum Option : int {
  kInput = 256,
  kOut,
  kReport,
  kCamera,
  kMethod,
  kParameters,
  kDevice,
  kTurntable,
  kSize,
  kJson,
  kWindow,
  kRealtime,
  kOutline,
  kQuiet,
  kHelp,
  kVersion,
};

constexpr std::array<option, 17> kOptions = {{
    {"input", required_argument, nullptr, kInput},
    {"out", required_argument, nullptr, kOut},
    {"report", required_argument, nullptr, kReport},
    {"camera", required_argument, nullptr, kCamera},
    {"method", required_argument, nullptr, kMethod},
    {"parameters", required_argument, nullptr, kParameters},
    {"device", required_argument, nullptr, kDevice},
    {"turntable", required_argument, nullptr, kTurntable},
    {"size", required_argument, nullptr, kSize},
    {"json", no_argument, nullptr, kJson},
    {"window", no_argument, nullptr, kWindow},
    {"realtime", no_argument, nullptr, kRealtime},
    {"outline", no_argument, nullptr, kOutline},
    {"quiet", no_argument, nullptr, kQuiet},
    {"help", no_argument, nullptr, kHelp},
    {"version", no_argument, nullptr, kVersion},
    {nullptr, 0, nullptr, 0},
}};

tl::unexpected<Error> usage(const char* code, std::string where, std::string cause) {
  return fail(ExitCode::kUsage, code, std::move(where), std::move(cause), "see modar-play --help");
}

/// A whole number from 1 to `limit`, 0 where the text is none.
int positive(std::string_view text, int limit) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && value >= 1 && value <= limit ? value : 0;
}

Result<void> set_size(PlayOptions& options, std::string_view text) {
  constexpr int kMaxSide = 8192;
  const std::size_t x = text.find('x');
  if (x != std::string_view::npos) {
    options.width = positive(text.substr(0, x), kMaxSide);
    options.height = positive(text.substr(x + 1), kMaxSide);
    if (options.width > 0 && options.height > 0) return {};
  }
  return usage("usage.value", "--size", "'" + std::string(text) + "' is no size like 640x480");
}

Result<void> set_turntable(PlayOptions& options, std::string_view text) {
  options.turntable = positive(text, 100'000);
  if (options.turntable > 0) return {};
  return usage("usage.value", "--turntable",
               "'" + std::string(text) + "' is no number of frames (1 to 100000)");
}

Result<void> apply(PlayOptions& options, int option, const char* value) {
  switch (option) {
    case kInput:
      options.input = value;
      break;
    case kOut:
      options.out = value;
      break;
    case kReport:
      options.report = value;
      break;
    case kCamera:
      options.camera_file = value;
      break;
    case kMethod:
      options.method = value;
      break;
    case kParameters:
      options.parameters = value;
      break;
    case kDevice:
      options.device = value;
      break;
    case kTurntable:
      return set_turntable(options, value);
    case kSize:
      return set_size(options, value);
    case kJson:
      options.json = true;
      break;
    case kWindow:
      options.window = true;
      break;
    case kRealtime:
      options.realtime = true;
      break;
    case kOutline:
      options.outline = true;
      break;
    case kQuiet:
      options.quiet = true;
      break;
    case kHelp:
      options.help = true;
      break;
    case kVersion:
      options.version = true;
      break;
    default:
      break;
  }
  return {};
}

Result<void> validate(const PlayOptions& options) {
  if (options.help || options.version) return {};
  if (options.bundle.empty()) return usage("usage.bundle", "", "no bundle is named");
  if (options.input.empty() && options.turntable == 0) {
    return usage("usage.input", "", "neither --input nor --turntable is given");
  }
  if (!options.input.empty() && options.turntable > 0) {
    return usage("usage.conflict", "", "--input and --turntable exclude each other");
  }
  if (options.turntable > 0 && options.out.empty()) {
    return usage("usage.out", "--turntable", "--out is missing, the pictures have no place to go");
  }
  if (options.method != "paper") {
    return usage("usage.method", "--method",
                 "'" + options.method + "' is no method; there is 'paper'");
  }
  return {};
}

}  // namespace

Result<PlayOptions> parse_options(std::span<const char* const> arguments) {
  // getopt_long permutes the array that it is given, not the texts: a copy of the pointers serves.
  std::string program = "modar-play";
  std::vector<char*> argv = {program.data()};
  for (const char* argument : arguments) argv.push_back(const_cast<char*>(argument));
  argv.push_back(nullptr);
  const int argc = static_cast<int>(argv.size()) - 1;

  PlayOptions options;
  opterr = 0;
  optind = 0;  // starts a new scan (GNU)
  for (;;) {
    const int option = getopt_long(argc, argv.data(), ":", kOptions.data(), nullptr);
    if (option == -1) break;
    if (option == '?' || option == ':') {
      // optopt: the letter of a short option, else our number or 0; optind points behind a long
      // one.
      const bool letter = optopt > 0 && optopt < kInput;
      const std::string current = letter ? std::string("-") + static_cast<char>(optopt)
                                         : argv[static_cast<std::size_t>(optind - 1)];
      if (option == ':') return usage("usage.value", current, "the option needs a value");
      if (optopt >= kInput) return usage("usage.value", current, "the option takes no value");
      return usage("usage.option", "", "'" + current + "' is no option");
    }
    if (auto applied = apply(options, option, optarg); !applied) {
      return tl::unexpected(applied.error());
    }
  }
  for (int i = optind; i < argc; ++i) {
    const std::string argument = argv[static_cast<std::size_t>(i)];
    if (!options.bundle.empty()) {
      return usage("usage.argument", "", "'" + argument + "' is one argument too many");
    }
    options.bundle = argument;
  }
  if (auto valid = validate(options); !valid) return tl::unexpected(valid.error());
  return options;
}

const char* help_text() {
  return R"(modar-play: plays a bundle over a video, pictures or a camera

Usage: modar-play BUNDLE --input VIDEO|IMAGE|FOLDER|camera[:N] [options]
       modar-play BUNDLE --turntable N --out FOLDER|FILE.mp4

  --input INPUT       frames: a video, a picture, a folder of pictures (by name), a camera
  --out OUT           pictures into FILE.mp4, or as frame_000000.png ... into a folder
  --report FOLDER     overlay.mp4, contact_sheet.png, frames.jsonl and an index.html of them
  --window            shows the pictures in a window (Escape or Q ends)
  --outline           draws the outline of each pattern that is seen
  --json              one JSON line a frame and a summary, to standard output
  --camera FILE.yml   camera matrix and distortion as OpenCV writes them
                      (default: focal length = width of the frame)
  --method paper      how patterns are found
  --parameters SET    orb-2000 (default), orb-500, brisk-3 or brisk-2, as baked
  --device NAME       acts as this device: masks what its OpenGL ES lacks
  --realtime          plays a file at its own speed and drops frames that come too early
  --turntable N       N pictures of each model turning, without any pattern
  --size WxH          of the turntable's pictures (default 640x480)
  --quiet             no progress, no summary
  --help, --version

Example: modar-play spider.modar --input box.mp4 --outline --report out/demo

Exit codes: 0 done (whether or not a pattern was seen), 1 usage, 2 a file cannot be read or
written, 3 bad input, 4 internal error, 5 beyond this build or device.
)";
}

}  // namespace modar
