// The command line of `modar check`.
#include <algorithm>
#include <memory>
#include <thread>

#include "bake/commands/check_command.hpp"
#include "bake/commands/commands.hpp"
#include "bake/terminal.hpp"
#include "modar/device_profile.hpp"

namespace modar {
namespace {

void add_source_options(CommandLine& line, CheckCommand& check) {
  line.option("--source", &check.sources,
              "Bake these models and pattern images again and compare; measure what differs; "
              "modar.toml stands for all of a project's, and for its texts",
              {.type = "FILE[:WIDTHmm]"});
  line.flag("--pose", check.pose,
            "Track the patterns of --source in rendered views: errors and working range",
            {.needs = "--source"});
  line.option("--pose-views", &check.pose_views, "Views of each size and tilt",
              {.shows_default = true, .least = 1, .most = 1000, .needs = "--pose"});
  line.option("--visual", &check.visual,
              "Render the models of --source and of the bundle from 12 sides and compare; the "
              "worst view of each goes to DIR",
              {.type = "DIR", .needs = "--source"});
}

void add_mutate_options(CommandLine& line, CheckCommand& check) {
  line.option("--mutate", &check.mutations,
              "Prove the checker instead: damage N copies of the bundle, count those found",
              {.type = "N", .positive = true});
  line.option("--seed", &check.seed, "Which mutations",
              {.shows_default = true, .needs = "--mutate"});
  line.option("--second-reader", &check.second_reader,
              "scripts/read_bundle.py: tells which survivors changed nothing",
              {.type = "FILE", .needs = "--mutate"});
}

int run(const CheckCommand& check) {
  if (check.bundle.empty() && !check.list_issues) {
    return print_error(
        {ExitCode::kUsage, "cli.bundle", "check", "no bundle is named", "modar check BUNDLE"});
  }
  return run_check(check);
}

}  // namespace

void add_check(CommandLine& program) {
  CommandLine& line = program.command("check", "Prove that a bundle is good");
  const auto check = std::make_shared<CheckCommand>();
  check->jobs = std::max(1u, std::thread::hardware_concurrency());
  check->tool_version = MODAR_VERSION;
  line.option("bundle", &check->bundle, "The bundle", {.type = "BUNDLE"});
  line.flag("--list-issues", check->list_issues,
            "Print all kinds of issues with their cures (ISSUES.md)", {.excludes = "bundle"});
  line.flag("--json", check->json, "Print verdict and issues as JSON");
  line.flag("--sarif", check->sarif, "Print them as SARIF 2.1.0, for CI systems",
            {.excludes = "--json"});
  line.option("--device", &check->device,
              "Hold the bundle against a device too: " + device_profile_names() +
                  ", or a file like those of assets/devices/",
              {.type = "NAME|FILE.json"});
  add_source_options(line, *check);
  line.option("--severity", &check->severities,
              "Weigh a kind of issue anew: ID=error, warning, info or ignore; repeatable",
              {.type = "ID=SEVERITY", .repeatable = true});
  line.flag("--warnings-as-errors", check->warnings_as_errors, "A warning makes the bundle bad");
  add_mutate_options(line, *check);
  line.footer(
      "\nExample:\n"
      "  modar check spider.modar --device mali400 --source spider.obj cover.png\n"
      "  modar check --mutate 100000 --second-reader scripts/read_bundle.py spider.modar\n"
      "\nExit codes: 0 ok, 1 wrong usage, 2 a file cannot be read or written, 3 invalid input,\n"
      "4 a bug of ours, 5 not supported. A bad bundle answers 3, and so does a proof that misses\n"
      "its goals.\n");
  line.run([check] { return ExitCode{run(*check)}; });
}

}  // namespace modar
