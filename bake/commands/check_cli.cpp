// The command line of `modar check`, told to CLI11 and taken from it as plain structs.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <thread>

#include "bake/commands/check_command.hpp"
#include "bake/terminal.hpp"
#include "modar/device_profile.hpp"

#ifndef MODAR_VERSION
#error "CMake defines MODAR_VERSION"
#endif

namespace modar {
namespace {

void add_options(CLI::App& app, CheckCommand& check) {
  CLI::Option* bundle = app.add_option("bundle", check.bundle, "The bundle")->type_name("BUNDLE");
  CLI::Option* list = app.add_flag("--list-issues", check.list_issues,
                                   "Print all kinds of issues with their cures (ISSUES.md)");
  bundle->excludes(list);
  CLI::Option* json = app.add_flag("--json", check.json, "Print verdict and issues as JSON");
  app.add_flag("--sarif", check.sarif, "Print them as SARIF 2.1.0, for CI systems")->excludes(json);
  app.add_option("--device", check.device,
                 "Hold the bundle against a device too: " + device_profile_names() +
                     ", or a file like those of assets/devices/")
      ->type_name("NAME|FILE.json");
  CLI::Option* source =
      app.add_option("--source", check.sources,
                     "Bake these models and pattern images again and compare; measure what differs")
          ->type_name("FILE");
  CLI::Option* pose =
      app.add_flag("--pose", check.pose,
                   "Track the patterns of --source in rendered views: errors and working range")
          ->needs(source);
  app.add_option("--pose-views", check.pose_views, "Views of each size and tilt")
      ->needs(pose)
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--visual", check.visual,
                 "Render the models of --source and of the bundle from 12 sides and compare; the "
                 "worst view of each goes to DIR")
      ->type_name("DIR")
      ->needs(source);
  app.add_option("--severity", check.severities,
                 "Weigh a kind of issue anew: ID=error, warning, info or ignore; repeatable")
      ->type_name("ID=SEVERITY")
      ->allow_extra_args(false);
  app.add_flag("--warnings-as-errors", check.warnings_as_errors, "A warning makes the bundle bad");
  CLI::Option* mutate =
      app.add_option("--mutate", check.mutations,
                     "Prove the checker instead: damage N copies of the bundle, count those found")
          ->type_name("N")
          ->check(CLI::PositiveNumber);
  app.add_option("--seed", check.seed, "Which mutations")->needs(mutate)->capture_default_str();
  app.add_option("--second-reader", check.second_reader,
                 "scripts/read_bundle.py: tells which survivors changed nothing")
      ->type_name("FILE")
      ->needs(mutate);
  app.footer(
      "\nExample:\n"
      "  modar check spider.modar --device mali400 --source spider.obj cover.png\n"
      "  modar check --mutate 100000 --second-reader scripts/read_bundle.py spider.modar\n"
      "\nExit codes: 0 ok, 1 wrong usage, 2 a file cannot be read or written, 3 invalid input,\n"
      "4 a bug of ours, 5 not supported. A bad bundle answers 3, and so does a proof that misses\n"
      "its goals.\n");
}

}  // namespace

bool needs_sources(const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), [](const std::string& word) {
    return word.starts_with("--source") || word.starts_with("--visual") ||
           word.starts_with("--pose");
  });
}

int run_check_line(std::vector<std::string> words, SourceStages stages) {
  CLI::App app("modar check: proves that a bundle is good", "modar check");
  CheckCommand check;
  check.jobs = std::max(1u, std::thread::hardware_concurrency());
  check.tool_version = MODAR_VERSION;
  add_options(app, check);
  try {
    std::reverse(words.begin(), words.end());  // CLI11 takes them from the back
    app.parse(words);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? static_cast<int>(ExitCode::kOk)
                                : static_cast<int>(ExitCode::kUsage);
  }
  if (check.bundle.empty() && !check.list_issues) {
    return print_error(
        {ExitCode::kUsage, "cli.bundle", "check", "no bundle is named", "modar check BUNDLE"});
  }
  return run_check(check, stages);
}

}  // namespace modar
