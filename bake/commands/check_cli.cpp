// The command line of `modar check`.
#include <algorithm>
#include <memory>
#include <thread>

#include "bake/commands/check_command.hpp"
#include "bake/commands/commands.hpp"
#include "bake/io/terminal.hpp"
#include "modar/device_profile.hpp"

namespace modar {
namespace {

void add_source_options(CommandLine& line, CheckCommand& check) {
  line.group("Compare with the sources");
  line.option("--source", &check.sources,
              "Bake these models and pattern images again, compare, and measure what differs; "
              "modar.toml means all files of a project",
              {.type = "FILE[:WIDTHmm]"});
  line.flag("--pose", check.pose,
            "Track the patterns of --source in rendered views: error and working range",
            {.needs = "--source"});
  line.option("--pose-views", &check.pose_views, "Views per size and tilt",
              {.shows_default = true, .least = 1, .most = 1000, .needs = "--pose"});
  line.option("--visual", &check.visual,
              "Render the models of --source and of the bundle from 12 sides and compare; write "
              "the worst view of each to DIR",
              {.type = "DIR", .needs = "--source"});
}

int run(const CheckCommand& check) {
  if (check.bundle.empty() && !check.list_issues) {
    return print_error(
        {ExitCode::kUsage, "cli.bundle", "check", "no bundle is given", "modar check BUNDLE"});
  }
  return run_check(check);
}

}  // namespace

void add_check(CommandLine& program) {
  CommandLine& line =
      program.command("check", "Validate a bundle, for a device and against its sources");
  const auto check = std::make_shared<CheckCommand>();
  check->jobs = std::max(1u, std::thread::hardware_concurrency());
  check->tool_version = MODAR_VERSION;
  line.option("bundle", &check->bundle, "The bundle", {.type = "BUNDLE"});
  line.flag("--list-issues", check->list_issues,
            "List every kind of issue with its cure (ISSUES.md)", {.excludes = "bundle"});
  line.flag("--json", check->json, "Print verdict and issues as JSON");
  line.flag("--sarif", check->sarif, "Print issues as SARIF 2.1.0, for CI systems",
            {.excludes = "--json"});
  line.option("--device", &check->device,
              "Also check the limits of a device: " + device_profile_names() +
                  ", or a profile file as in assets/devices/",
              {.type = "NAME|FILE.json"});
  add_source_options(line, *check);
  line.group("Severity");
  line.option("--severity", &check->severities,
              "Set the severity of a kind of issue: error, warning, info or ignore; repeatable",
              {.type = "ID=SEVERITY", .repeatable = true});
  line.flag("--warnings-as-errors", check->warnings_as_errors, "Treat warnings as errors");
  line.footer(
      "\nExample:\n"
      "  modar check spider.modar --device mali400 --source spider.obj cover.png\n"
      "\nExit codes: 0 ok, 1 wrong usage, 2 a file cannot be read or written, 3 invalid input,\n"
      "4 internal error, 5 not supported. A bad bundle exits with 3.\n");
  line.run([check] { return ExitCode{run(*check)}; });
}

}  // namespace modar
