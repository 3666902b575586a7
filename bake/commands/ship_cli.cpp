// The command line of `modar ship`, told to CLI11 and taken from it as plain structs.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <thread>

#include "bake/commands/arguments.hpp"
#include "bake/commands/ship_command.hpp"
#include "bake/terminal.hpp"

namespace modar {
namespace {

std::string ship_example(const std::string& text) {
  return example(text, ", 15 another publisher is at work on the folder");
}

void add_key_options(CLI::App& sub, std::string& key, std::string& pass_phrase_file) {
  sub.add_option("--key", key, "The secret key")->required()->type_name("K");
  sub.add_option("--pass-phrase-file", pass_phrase_file,
                 "Its pass phrase, the file's first line; else it is asked for")
      ->type_name("FILE");
}

CLI::App* add_keygen(CLI::App& app, KeygenCommand& keygen) {
  CLI::App* sub = app.add_subcommand("keygen", "A new pair of keys, in minisign's files");
  sub->add_option("--out", keygen.out, "The secret key; the public one goes to K.pub")
      ->required()
      ->type_name("K");
  sub->add_option("--pass-phrase-file", keygen.pass_phrase_file,
                  "Encrypt the secret key with the file's first line")
      ->type_name("FILE");
  sub->add_flag("--force", keygen.force, "Write over a key that is there");
  sub->footer(ship_example("  modar ship keygen --out museum.key\n"));
  return sub;
}

CLI::App* add_publish(CLI::App& app, ShipPublishCommand& publish) {
  CLI::App* sub = app.add_subcommand("publish", "A signed release of bundles into a folder");
  sub->add_option("bundles", publish.request.bundles, "The bundles; files name them")
      ->required()
      ->type_name("BUNDLE...");
  sub->add_option("--to", publish.request.folder, "The folder that devices will fetch from")
      ->required()
      ->type_name("DIR");
  add_key_options(*sub, publish.key_file, publish.pass_phrase_file);
  CLI::Option* expires = sub->add_option("--expires", publish.expires,
                                         "When devices stop believing it, as 2027-01-31T00:00:00Z")
                             ->type_name("TIME");
  sub->add_option("--valid-days", publish.valid_days, "The same, from now")
      ->check(CLI::Range(1u, 36500u))
      ->capture_default_str()
      ->excludes(expires);
  sub->add_option("--release", publish.request.version,
                  "Its number; greater than all before (one more than the newest)")
      ->type_name("N");
  sub->add_option("--for", publish.devices, "A bundle is for these device profiles only")
      ->type_name("NAME=PROFILE[,PROFILE]");
  sub->add_option("--jobs", publish.request.recipe.jobs, "Processes; the bytes do not depend on it")
      ->check(CLI::Range(1u, 256u))
      ->capture_default_str();
  sub->add_flag("--quiet", publish.quiet, "No progress, no summary");
  sub->add_flag("--json", publish.json, "Print the release and what was written as JSON");
  sub->footer(ship_example("  modar ship publish vase.modar --to /var/www/ar --key museum.key\n"));
  return sub;
}

CLI::App* add_rotate(CLI::App& app, RotateCommand& rotate) {
  CLI::App* sub = app.add_subcommand("rotate", "Let devices follow from the old key to a new one");
  sub->add_option("--to", rotate.folder, "The folder that devices fetch from")
      ->required()
      ->type_name("DIR");
  add_key_options(*sub, rotate.key_file, rotate.pass_phrase_file);
  sub->add_option("--next", rotate.next_key, "The new public key; publish with its secret one then")
      ->required()
      ->type_name("NEW.pub");
  sub->footer(
      ship_example("  modar ship rotate --to /var/www/ar --key old.key --next new.key.pub\n"));
  return sub;
}

CLI::App* add_prune(CLI::App& app, PruneCommand& prune) {
  CLI::App* sub = app.add_subcommand("prune", "Remove old releases and what only they need");
  sub->add_option("--to", prune.folder, "The folder")->required()->type_name("DIR");
  sub->add_option("--keep", prune.keep, "Newest releases that stay")
      ->check(CLI::Range(1u, 1000000u))
      ->capture_default_str();
  sub->add_flag("--json", prune.json, "Print what was freed as JSON");
  sub->footer(ship_example("  modar ship prune --to /var/www/ar --keep 3\n"));
  return sub;
}

CLI::App* add_plan(CLI::App& app, PlanCommand& plan) {
  CLI::App* sub = app.add_subcommand("plan", "Bytes and minutes of an update, before publishing");
  sub->add_option("old", plan.old_bundle, "The bundle that devices have")
      ->required()
      ->type_name("OLD");
  sub->add_option("new", plan.new_bundle, "The one that they will get")
      ->required()
      ->type_name("NEW");
  sub->add_option("--link", plan.link, "The network: 2g, 3g, 4g or wifi")->capture_default_str();
  sub->add_option("--device", plan.device,
                  "Device profile: cores, storage (" + device_profile_names() + ")")
      ->type_name("NAME");
  sub->add_option("--jobs", plan.recipe.jobs, "Processes")->check(CLI::Range(1u, 256u));
  sub->add_flag("--json", plan.json, "Print as JSON");
  sub->footer(ship_example("  modar ship plan old.modar new.modar --link 2g --device ace2\n") +
              "A device on a cable needs no release: `adb push NAME.modar /sdcard/modar/`.\n");
  return sub;
}

}  // namespace

int run_ship(std::vector<std::string> arguments) {
  CLI::App app("modar ship: releases that devices install with modar-fetch", "modar ship");
  app.require_subcommand(1);
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  KeygenCommand keygen;
  ShipPublishCommand publish;
  RotateCommand rotate;
  PruneCommand prune;
  PlanCommand plan;
  publish.request.recipe.jobs = plan.recipe.jobs = cores;
  const CLI::App* keygen_sub = add_keygen(app, keygen);
  const CLI::App* publish_sub = add_publish(app, publish);
  const CLI::App* rotate_sub = add_rotate(app, rotate);
  const CLI::App* prune_sub = add_prune(app, prune);
  const CLI::App* plan_sub = add_plan(app, plan);
  try {
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? static_cast<int>(ExitCode::kOk)
                                : static_cast<int>(ExitCode::kUsage);
  }
  if (keygen_sub->parsed()) return run_keygen(keygen);
  if (publish_sub->parsed()) return run_publish(publish);
  if (rotate_sub->parsed()) return run_rotate(rotate);
  if (prune_sub->parsed()) return run_prune(prune);
  if (plan_sub->parsed()) return run_plan(plan);
  return static_cast<int>(ExitCode::kUsage);
}

}  // namespace modar
