// `modar bake` of a project, for bake_command.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake/commands/command_line.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// Options of `modar bake` that go with modar.toml.
struct ProjectCommand {
  std::string file;       ///< empty: modar.toml in the current folder
  std::string cache;      ///< empty: as the project says
  std::string cache_key;  ///< file; empty: entries are not signed
  std::string asset;      ///< empty: all
  std::string depfile;    ///< empty: none
  bool dry_run = false;
  bool explain = false;
  bool outside = false;  ///< the project may use files outside its folder
  bool watch = false;    ///< bake again whenever something changes
};

/// Declares them.
void add_project_options(CommandLine& line, ProjectCommand& command);

/// Options of the bake that are the same for projects and single bundles.
struct CommonOptions {
  unsigned jobs = 1;
  std::uint64_t memory_bytes = 0;
  bool quiet = false;
  bool json = false;
  bool notes = false;
  bool progress_json = false;
};

/// How each scene's model stands, on stderr: whoever set nothing sees the chosen ones here.
void print_scenes(const BundleView& bundle);

/// words: of the command line, to refuse options that belong in the file.
Result<ExitCode> run_project(const ProjectCommand& command, const CommonOptions& common,
                             const std::vector<std::string>& words);

}  // namespace modar
