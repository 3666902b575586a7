// The command line of modar-fetch.
#pragma once

#include "modar/fetch.hpp"

namespace modar::fetch {

struct CommandLine {
  FetchOptions options;
  std::string trust_file;
  bool verify = false;  ///< only look at what is installed
  bool json = false;
  bool quiet = false;
  bool help = false;
  bool version = false;
};

/// Errors: kUsage "cli.*".
Result<CommandLine> parse_command_line(int argc, char** argv);
/// What --help prints.
const char* help_text();

}  // namespace modar::fetch
