// The command line of modar-play.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "formats/base/error.hpp"

namespace modar {

/// Beyond ExitCode: --golden ran and found another result than the recording's.
inline constexpr int kExitDifferent = 10;

struct PlayOptions {
  std::string bundle;
  std::string input;   ///< path, "camera" or "camera:N"
  std::string out;     ///< folder or FILE.mp4; empty: no pictures
  std::string report;  ///< folder; empty: none
  std::string record;  ///< folder; empty: none
  std::string golden;  ///< folder of a recording to replay; empty: none
  std::string qos;     ///< file; empty: none
  std::string camera_file;
  std::string gyro;              ///< file of a gyroscope's turns; empty: none
  std::string method;            ///< "ours", "paper"; empty: see choose_method()
  std::string parameters;        ///< empty: orb-2000 where the bundle has it, else its first
  std::string device;            ///< empty: the context unchanged
  double tolerance = 0.5;        ///< pixels; of --golden
  double smooth_ms = 0;          ///< latency that smoothing may add; 0: off
  std::uint64_t gpu_budget = 0;  ///< bytes; 0: the device's
  int copies = 0;                ///< of each pattern that are tracked, at most; 0: as baked
  int turntable = 0;             ///< frames of a turn; 0: no turntable
  int width = 640;               ///< of turntable pictures
  int height = 480;
  bool json = false;
  bool extended = false;    ///< continue from the surroundings of a pattern that is not visible
  bool homography = false;  ///< each pattern's in the JSON lines
  bool force = false;       ///< into folders that hold other files
  bool window = false;
  bool realtime = false;
  bool live = false;  ///< play newer versions of the bundle as they come
  bool outline = false;
  bool no_light_estimate = false;
  bool osd = false;
  bool sound = false;  ///< what sounds is heard from the start
  bool quiet = false;
  bool verify = false;  ///< hash the whole bundle before playing it
  bool help = false;
  bool help_all = false;
  bool version = false;
};

/// arguments: argv without the program's name. Errors: kUsage "usage.*" (the cure names --help).
Result<PlayOptions> parse_options(std::span<const char* const> arguments);

/// "64M", "1G", "512K" or plain bytes; 0 for any other.
std::uint64_t parse_bytes(std::string_view text);

/// What --help prints, or with `all` --help-all.
std::string help_text(bool all);

}  // namespace modar
