// The command line of `modar ship`.
#include <algorithm>
#include <memory>
#include <thread>

#include "bake/commands/commands.hpp"
#include "bake/commands/ship_command.hpp"
#include "bake/io/terminal.hpp"
#include "modar/device_profile.hpp"

namespace modar {
namespace {

std::string ship_example(const std::string& text) {
  return example(text, ", 15 another publisher is at work on the folder");
}

void add_key_options(CommandLine& line, std::string& key, std::string& pass_phrase_file) {
  line.option("--key", &key, "Secret key", {.type = "K", .required = true});
  line.option("--pass-phrase-file", &pass_phrase_file,
              "File whose first line is the pass phrase (default: ask for it)", {.type = "FILE"});
}

void add_keygen(CommandLine& ship) {
  CommandLine& line = ship.command("keygen", "Make a new pair of keys, in minisign's format");
  const auto keygen = std::make_shared<KeygenCommand>();
  line.option("-o,--out", &keygen->out, "Secret key to write; the public key goes to K.pub",
              {.type = "K", .required = true});
  line.option("--pass-phrase-file", &keygen->pass_phrase_file,
              "Encrypt the secret key with the file's first line", {.type = "FILE"});
  line.flag("--force", keygen->force, "Overwrite an existing key");
  line.footer(ship_example("  modar ship keygen --out museum.key\n"));
  line.run([keygen] { return ExitCode{run_keygen(*keygen)}; });
}

void add_publish(CommandLine& ship) {
  CommandLine& line = ship.command("publish", "Publish bundles as a signed release");
  const auto publish = std::make_shared<ShipPublishCommand>();
  PublishRequest& request = publish->request;
  request.recipe.jobs = std::max(1u, std::thread::hardware_concurrency());
  line.option("bundles", &request.bundles,
              "New or changed bundles; other bundles stay in the release", {.type = "BUNDLE..."});
  line.option("--to", &request.folder, "Folder that devices fetch from",
              {.type = "DIR", .required = true});
  add_key_options(line, publish->key_file, publish->pass_phrase_file);
  line.flag("--dry-run", request.dry_run, "Show what would change, and write nothing");
  line.option("--drop", &request.drop, "Remove this bundle from the release; repeatable",
              {.type = "NAME", .repeatable = true});
  line.group("Validity, numbers and devices", Shown::kInFull);
  line.option("--expires", &publish->expires,
              "Time when the release expires, as 2027-01-31T00:00:00Z", {.type = "TIME"});
  line.option("--valid-days", &publish->valid_days, "Days until the release expires",
              {.shows_default = true, .least = 1, .most = 36500, .excludes = "--expires"});
  line.flag("--no-expiry", publish->no_expiry, "The release never expires: for USB sticks",
            {.excludes = "--expires"});
  line.option(
      "--fresh-days", &publish->fresh_days,
      "Days that a release stays valid after each `modar ship refresh`; 0: no such limit. Kept "
      "for later releases",
      {.type = "N", .least = 0, .most = 36500});
  line.option("--release", &request.version,
              "Release number, greater than all before (default: the newest plus one)",
              {.type = "N"});
  line.option("--for", &publish->devices, "Limit a bundle to these device profiles",
              {.type = "NAME=PROFILE[,PROFILE]"});
  line.option("--jobs", &request.recipe.jobs, "Processes; the output does not depend on it",
              {.shows_default = true, .least = 1, .most = 256});
  line.flag("--quiet", publish->quiet, "No progress or summary");
  line.flag("--json", publish->json, "Print the release and the written files as JSON");
  line.footer(ship_example("  modar ship publish vase.modar --to /var/www/ar --key museum.key\n"));
  line.run([publish] { return ExitCode{run_publish(*publish)}; });
}

void add_refresh(CommandLine& ship) {
  CommandLine& line =
      ship.command("refresh", "Confirm that the newest release is still current (daily, by cron)");
  const auto refresh = std::make_shared<RefreshCommand>();
  line.option("--to", &refresh->folder, "Folder that devices fetch from",
              {.type = "DIR", .required = true});
  add_key_options(line, refresh->key_file, refresh->pass_phrase_file);
  line.footer(ship_example("  modar ship refresh --to /var/www/ar --key museum.key\n"));
  line.run([refresh] { return ExitCode{run_refresh(*refresh)}; });
}

void add_rotate(CommandLine& ship) {
  CommandLine& line = ship.command("rotate", "Move devices from the old key to a new one");
  const auto rotate = std::make_shared<RotateCommand>();
  line.option("--to", &rotate->folder, "Folder that devices fetch from",
              {.type = "DIR", .required = true});
  add_key_options(line, rotate->key_file, rotate->pass_phrase_file);
  line.option("--next", &rotate->next_key, "New public key; then publish with its secret key",
              {.type = "NEW.pub", .required = true});
  line.footer(
      ship_example("  modar ship rotate --to /var/www/ar --key old.key --next new.key.pub\n"));
  line.run([rotate] { return ExitCode{run_rotate(*rotate)}; });
}

void add_root(CommandLine& ship) {
  CommandLine& line =
      ship.command("root", "Name the signing key, with the root key that devices trust");
  const auto root = std::make_shared<RootCommand>();
  line.option("--to", &root->folder, "Folder that devices fetch from",
              {.type = "DIR", .required = true});
  add_key_options(line, root->key_file, root->pass_phrase_file);
  line.option("--next", &root->next_key, "Public key that signs from now on", {.type = "NEW.pub"});
  line.option("--draft", &root->draft,
              "With several root keys: write and sign this draft, which the others sign "
              "(`modar ship sign`) before `modar ship accept`",
              {.type = "FILE"});
  line.option("--roots", &root->roots,
              "Public root keys that replace the present ones, instead of a signing key",
              {.type = "K.pub", .needs = "--draft", .excludes = "--next"});
  line.option("--threshold", &root->threshold, "How many of --roots must agree",
              {.least = 1, .most = 16, .needs = "--roots"});
  line.footer(
      ship_example("  modar ship root --to /var/www/ar --key root.key --next museum.key.pub\n"
                   "  modar ship root --to /var/www/ar --key a.key --next museum.key.pub --draft "
                   "new.json\n") +
      "Keep the root key offline. If a signing key was stolen, name a new one: devices drop the\n"
      "stolen key and what it signed since, and release numbers start again.\n");
  line.run([root] {
    if (root->next_key.empty() && root->roots.empty()) {
      return ExitCode{print_error({ExitCode::kUsage, "ship.root", "ship root", "no key is named",
                                   "name the one that signs with --next NEW.pub"})};
    }
    return ExitCode{run_root(*root)};
  });
}

void add_trust(CommandLine& ship) {
  CommandLine& line =
      ship.command("trust", "Combine several root keys, of which K of N must agree, in one file");
  const auto trust = std::make_shared<TrustCommand>();
  line.option("keys", &trust->keys, "Public keys", {.type = "K.pub...", .required = true});
  line.option("--threshold", &trust->threshold, "How many of them must agree",
              {.required = true, .least = 1, .most = 16});
  line.option("-o,--out", &trust->out,
              "File to write, for `modar-fetch --trust` and wherever K.pub is accepted",
              {.type = "FILE", .required = true});
  line.footer(ship_example(
      "  modar ship trust a.key.pub b.key.pub c.key.pub --threshold 2 --out museum.trust\n"));
  line.run([trust] { return ExitCode{run_trust(*trust)}; });
}

void add_sign(CommandLine& ship) {
  CommandLine& line =
      ship.command("sign", "Sign a draft of `modar ship root`, on your own machine");
  const auto sign = std::make_shared<SignCommand>();
  line.option("draft", &sign->draft, "Draft to sign; its contents are printed",
              {.type = "FILE", .required = true});
  add_key_options(line, sign->key_file, sign->pass_phrase_file);
  line.footer(
      ship_example("  modar ship sign new.json --key b.key\n") +
      "The signature is written next to the draft. `minisign -Sm` also works: rename its file.\n");
  line.run([sign] { return ExitCode{run_sign(*sign)}; });
}

void add_accept(CommandLine& ship) {
  CommandLine& line = ship.command("accept", "Publish a draft that enough root keys have signed");
  const auto accept = std::make_shared<AcceptCommand>();
  line.option("draft", &accept->draft, "Draft, with its signatures in the same folder",
              {.type = "FILE", .required = true});
  line.option("--to", &accept->folder, "Folder that devices fetch from",
              {.type = "DIR", .required = true});
  line.option("--trust", &accept->trust, "Root keys that devices trust",
              {.type = "FILE", .required = true});
  line.footer(
      example("  modar ship accept new.json --to /var/www/ar --trust museum.trust\n",
              ", 10 too few root keys signed it, 15 another publisher is at work on the folder"));
  line.run([accept] { return ExitCode{run_accept(*accept)}; });
}

void add_list(CommandLine& ship) {
  CommandLine& line =
      ship.command("list", "List releases with their dates, sizes, bundles and expiry");
  const auto list = std::make_shared<ListCommand>();
  line.option("--to", &list->folder, "Release folder", {.type = "DIR", .required = true});
  line.flag("--json", list->json, "Print as JSON");
  line.footer(ship_example("  modar ship list --to /var/www/ar\n"));
  line.run([list] { return ExitCode{run_list(*list)}; });
}

void add_prune(CommandLine& ship) {
  CommandLine& line =
      ship.command("prune", "Remove old releases and the files that only they need");
  const auto prune = std::make_shared<PruneCommand>();
  line.option("--to", &prune->folder, "Release folder", {.type = "DIR", .required = true});
  line.option("--keep", &prune->keep, "Number of newest releases to keep",
              {.shows_default = true, .least = 1, .most = 1000000});
  line.flag("--json", prune->json, "Print the removed files as JSON");
  line.footer(ship_example("  modar ship prune --to /var/www/ar --keep 3\n"));
  line.run([prune] { return ExitCode{run_prune(*prune)}; });
}

void add_verify(CommandLine& ship) {
  CommandLine& line =
      ship.command("verify", "Verify all signatures and objects of a release folder or mirror");
  const auto verify = std::make_shared<VerifyCommand>();
  line.option("place", &verify->place, "Folder or address that devices fetch from",
              {.type = "DIR|URL", .required = true});
  line.option("--trust", &verify->trust, "Public key that devices trust",
              {.type = "K.pub", .required = true});
  line.flag("--json", verify->json, "Print the result as JSON");
  line.footer(
      example("  modar ship verify https://museum.example/ar --trust museum.key.pub\n",
              ", 10 another key signed it, 13 files of different releases, 3 objects are damaged"));
  line.run([verify] { return ExitCode{run_verify(*verify)}; });
}

void add_ship_plan(CommandLine& ship) {
  CommandLine& line =
      ship.command("plan", "Estimate the size and time of an update before publishing");
  const auto plan = std::make_shared<PlanCommand>();
  plan->recipe.jobs = std::max(1u, std::thread::hardware_concurrency());
  line.option("old", &plan->old_bundle, "Bundle that devices have",
              {.type = "OLD", .required = true});
  line.option("new", &plan->new_bundle, "Bundle that they will get",
              {.type = "NEW", .required = true});
  line.option("--link", &plan->link, "Network: 2g, 3g, 4g or wifi", {.shows_default = true});
  line.option("--device", &plan->device,
              "Device profile: cores and storage (" + device_profile_names() + ")",
              {.type = "NAME"});
  line.option("--jobs", &plan->recipe.jobs, "Processes", {.least = 1, .most = 256});
  line.flag("--json", plan->json, "Print as JSON");
  line.footer(ship_example("  modar ship plan old.modar new.modar --link 2g --device ace2\n") +
              "For a device on a cable, use `adb push NAME.modar /sdcard/modar/`.\n");
  line.run([plan] { return ExitCode{run_plan(*plan)}; });
}

}  // namespace

void add_ship(CommandLine& program) {
  CommandLine& line = program.command(
      "ship",
      "Publish signed releases: keygen, publish, list, root, trust, sign, accept, rotate, "
      "refresh, prune, verify, plan");
  add_keygen(line);
  add_publish(line);
  add_list(line);
  add_root(line);
  add_trust(line);
  add_sign(line);
  add_accept(line);
  add_rotate(line);
  add_refresh(line);
  add_prune(line);
  add_verify(line);
  add_ship_plan(line);
}

}  // namespace modar
