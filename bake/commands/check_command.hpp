// `modar check`: its options, and what it runs. check_cli.cpp fills the options.
#pragma once

#include <string>
#include <vector>

#include "bake/commands/check_json.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"

namespace modar {

struct CheckCommand {
  std::string bundle;
  bool json = false;
  bool warnings_as_errors = false;
  bool sarif = false;
  std::vector<std::string> severities;  ///< "ID=warning": weighed anew
  std::string visual;                   ///< folder for pictures of worst views; empty: no look
  int pose_views = 6;                   ///< of each size and tilt
  bool pose = false;                    ///< measure the patterns' working ranges
  std::vector<std::string> sources;     ///< models and pattern images to hold the bundle against
  unsigned jobs = 1;
  std::string device;  ///< profile that the bundle is held against, or its file; empty: none
  std::string tool_version;
  bool list_issues = false;  ///< print ISSUES.md instead
};

/// Rebakes, looks and tracks, as the command asks; command.sources is not empty.
/// Errors: those of check_source(), check_looks() and check_poses(); kIo "io.folder".
Result<void> check_against_sources(const BundleView& bundle, const CheckCommand& command,
                                   const IssueSink& sink, CheckExtras& extras);

/// Prints data to stdout and diagnostics to stderr, and answers the exit code.
int run_check(const CheckCommand& command);

}  // namespace modar
