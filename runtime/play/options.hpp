// The command line of modar-play.
#pragma once

#include <span>
#include <string>

#include "formats/error.hpp"

namespace modar {

struct PlayOptions {
  std::string bundle;
  std::string input;   ///< path, "camera" or "camera:N"
  std::string out;     ///< folder or FILE.mp4; empty: no pictures
  std::string report;  ///< folder; empty: none
  std::string camera_file;
  std::string method = "paper";
  std::string parameters;  ///< empty: orb-2000 where the bundle has it, else its first
  std::string device;      ///< empty: the context as it is
  int turntable = 0;       ///< frames of a turn; 0: no turntable
  int width = 640;         ///< of turntable pictures
  int height = 480;
  bool json = false;
  bool window = false;
  bool realtime = false;
  bool outline = false;
  bool quiet = false;
  bool help = false;
  bool version = false;
};

/// arguments: argv without the program's name. Errors: kUsage "usage.*" (the cure names --help).
Result<PlayOptions> parse_options(std::span<const char* const> arguments);

/// What --help prints.
const char* help_text();

}  // namespace modar
