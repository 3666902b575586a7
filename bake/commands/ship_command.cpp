// `modar ship`: releases, and the cost of an update.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>
#include <thread>

#include "bake/commands/ship_keys.hpp"
#include "bake/io/terminal.hpp"
#include "bake/json.hpp"
#include "bake/ship/http/http_reader.hpp"
#include "bake/ship/publish.hpp"
#include "bake/ship/release_folder.hpp"
#include "bake/ship/verify_release.hpp"
#include "modar/device_profile.hpp"

namespace modar {
namespace {

struct ShipPublishCommand {
  PublishRequest request;
  KeyFiles key;
  std::string expires;  ///< a time, or empty
  unsigned valid_days = 365;
  bool no_expiry = false;
  int fresh_days = -1;               ///< -1: as the newest release has it
  std::vector<std::string> devices;  ///< NAME=PROFILE[,PROFILE]
  bool quiet = false;
  bool json = false;
};

constexpr std::int64_t kDay = 86400;

/// Of PieceForm, whose first is 1.
constexpr const char* kFormNames[] = {"stored",       "zstd",  "zstd-etc1",      "mesh",
                                      "derived-text", "level", "tracker-record", "coded"};

/// The --json documents' keys are a contract (json.md).
std::string publish_json(const PublishReport& report) {
  Json forms = Json::array();
  for (const auto& [form, totals] : report.forms) {
    forms.push_back({{"form", kFormNames[static_cast<std::size_t>(form) - 1]},
                     {"pieces", totals.pieces},
                     {"raw_bytes", totals.raw_bytes},
                     {"stored_bytes", totals.stored_bytes}});
  }
  const Json changes = Json::list(report.changes, [&](const BundleChange& change) -> Json {
    return {{"change", to_string(change.kind)}, {"name", change.name}};
  });
  const Json json = {{"release", Json::parse(release_text(report.release))},
                     {"added_bytes", report.added_bytes},
                     {"changes", changes},
                     {"forms", forms}};
  return json.dump();
}

/// "NAME=ace2,mali400" into the request. Errors: kUsage "ship.for".
Result<void> take_devices(const std::string& text, PublishRequest& request) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  std::string rest = equals == std::string::npos ? "" : text.substr(equals + 1);
  if (rest == "all") {
    request.devices[name] = {};
    return {};
  }
  while (!rest.empty()) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string device = rest.substr(0, comma);
    if (find_device_profile(device) == nullptr) {
      return fail(ExitCode::kUsage, "ship.for", device, "there is no such device profile",
                  "choose from " + device_profile_names());
    }
    request.devices[name].push_back(device);
    rest.erase(0, comma + 1);
  }
  if (request.devices[name].empty()) {
    return fail(ExitCode::kUsage, "ship.for", text, "it names no device",
                "write it as --for vase=ace2,mali400, or vase=all");
  }
  return {};
}

std::string expiry_text(std::int64_t expires) {
  if (expires == kNever) return "does not expire";
  return (expires <= std::time(nullptr) ? "expired " : "valid until ") + time_text(expires);
}

Result<ExitCode> run_publish(ShipPublishCommand& command) {
  MODAR_ASSIGN(const auto key, load_key(command.key));
  for (const std::string& text : command.devices) {
    MODAR_TRY(take_devices(text, command.request));
  }
  command.request.expires =
      command.no_expiry ? kNever : std::time(nullptr) + kDay * command.valid_days;
  if (!command.expires.empty()) {
    const auto time = parse_time(command.expires);
    if (!time) {
      return fail(ExitCode::kUsage, "ship.expires", "--expires " + command.expires,
                  time.error().cause, "write it as 2027-01-31T00:00:00Z");
    }
    command.request.expires = *time;
  }
  if (command.fresh_days >= 0) {
    command.request.fresh_days = static_cast<std::uint64_t>(command.fresh_days);
  }
  ProgressBar bar(command.quiet || command.json);
  Report stages;
  stages.progress = [&](const std::string& stage, double done) { bar.show(stage, done); };
  auto published = publish(command.request, key, stages);
  bar.clear();
  MODAR_ASSIGN(const PublishReport report, std::move(published));
  if (report.release.expires <= std::time(nullptr)) {
    std::fprintf(stderr,
                 "warning: --expires %s: the time is past: devices refuse this release; publish "
                 "again with a later one [ship.expired]\n",
                 time_text(report.release.expires).c_str());
  }
  if (command.json) {
    std::fputs(publish_json(report).c_str(), stdout);
  } else if (!command.quiet) {
    std::fprintf(stderr, "release %llu%s: %s added to %s\n",
                 static_cast<unsigned long long>(report.release.version),
                 command.request.dry_run ? " (dry run: nothing is written)" : "",
                 human_bytes(report.added_bytes).c_str(), command.request.folder.c_str());
    std::fprintf(stderr, "  %s\n", expiry_text(report.release.expires).c_str());
    for (const BundleChange& change : report.changes) {
      std::fprintf(stderr, "  %-8s%s\n", to_string(change.kind), change.name.c_str());
    }
    for (const ReleaseBundle& bundle : report.release.bundles) {
      std::fprintf(stderr, "  %s: %s installed, %s to download in %u pieces\n", bundle.name.c_str(),
                   human_bytes(bundle.size).c_str(), human_bytes(bundle.download_size).c_str(),
                   bundle.pieces);
    }
  }
  return ExitCode::kOk;
}

void add_publish(CommandLine& ship) {
  CommandLine& line = ship.command("publish", "Publish bundles as a signed release");
  const auto publish = std::make_shared<ShipPublishCommand>();
  PublishRequest& request = publish->request;
  request.recipe.jobs = std::max(1u, std::thread::hardware_concurrency());
  line.option("bundles", &request.bundles,
              "New or changed bundles; other bundles stay in the release", {.type = "BUNDLE..."});
  add_folder(line, request.folder);
  add_key_options(line, publish->key);
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
  line.flag("--force", request.force, "Write into a folder that contains other files");
  line.flag("--quiet", publish->quiet, "No progress or summary");
  line.flag("--json", publish->json, "Print the release and the written files as JSON");
  line.footer(ship_example("  modar ship publish vase.modar --to /var/www/ar --key museum.key\n"));
  line.run([publish] { return run_publish(*publish); });
}

struct RefreshCommand {
  std::string folder;
  KeyFiles key;
};

Result<ExitCode> run_refresh(const RefreshCommand& command) {
  MODAR_ASSIGN(const auto key, load_key(command.key));
  MODAR_ASSIGN(const auto folder, ReleaseFolder::open(command.folder));
  MODAR_TRY(folder.check_signer(key.public_key));
  MODAR_ASSIGN(const auto newest, folder.newest());
  if (!newest || newest->fresh_days == 0) {
    return fail(ExitCode::kUsage, "ship.fresh", command.folder,
                "its newest release has no --fresh-days", "publish with --fresh-days 7 first");
  }
  MODAR_TRY(folder.add_freshness(*newest, std::time(nullptr), key));
  std::fprintf(stderr, "release %llu confirmed as the newest for %llu days\n",
               static_cast<unsigned long long>(newest->version),
               static_cast<unsigned long long>(newest->fresh_days));
  return ExitCode::kOk;
}

void add_refresh(CommandLine& ship) {
  CommandLine& line =
      ship.command("refresh", "Confirm that the newest release is still current (daily, by cron)");
  const auto refresh = std::make_shared<RefreshCommand>();
  add_folder(line, refresh->folder);
  add_key_options(line, refresh->key);
  line.footer(ship_example("  modar ship refresh --to /var/www/ar --key museum.key\n"));
  line.run([refresh] { return run_refresh(*refresh); });
}

struct ListCommand {
  std::string folder;
  bool json = false;
};

Result<ExitCode> run_list(const ListCommand& command) {
  MODAR_ASSIGN(const auto folder, ReleaseFolder::open(command.folder));
  MODAR_ASSIGN(const auto newest, folder.newest());
  Json list = Json::array();
  for (const std::uint64_t version : folder.versions()) {
    MODAR_ASSIGN(const Release release, folder.release(version));
    const std::string published = time_text(folder.published(version));
    const bool current = newest && newest->version == version;
    if (command.json) {
      list.push_back({{"release", Json::parse(release_text(release))},
                      {"published", published},
                      {"current", current}});
      continue;
    }
    std::printf("%s release %llu, published %s, %s\n", current ? "*" : " ",
                static_cast<unsigned long long>(version), published.c_str(),
                expiry_text(release.expires).c_str());
    for (const ReleaseBundle& bundle : release.bundles) {
      std::printf("    %s: %s installed, %s to download\n", bundle.name.c_str(),
                  human_bytes(bundle.size).c_str(), human_bytes(bundle.download_size).c_str());
    }
  }
  if (command.json) std::fputs(Json({{"releases", list}}).dump().c_str(), stdout);
  return ExitCode::kOk;
}

void add_list(CommandLine& ship) {
  CommandLine& line =
      ship.command("list", "List releases with their dates, sizes, bundles and expiry");
  const auto list = std::make_shared<ListCommand>();
  line.option("--to", &list->folder, "Release folder", {.type = "DIR", .required = true});
  line.flag("--json", list->json, "Print as JSON");
  line.footer(ship_example("  modar ship list --to /var/www/ar\n"));
  line.run([list] { return run_list(*list); });
}

struct PruneCommand {
  std::string folder;
  std::uint64_t keep = 2;
  bool json = false;
};

Result<ExitCode> run_prune(const PruneCommand& command) {
  MODAR_ASSIGN(const auto folder, ReleaseFolder::open(command.folder));
  MODAR_ASSIGN(const auto freed, folder.prune(command.keep));
  if (command.json) {
    const Json releases = Json::list(folder.versions());
    std::fputs(Json({{"freed_bytes", freed}, {"releases", releases}}).dump().c_str(), stdout);
  } else {
    std::fprintf(stderr, "%s freed\n", human_bytes(freed).c_str());
  }
  return ExitCode::kOk;
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
  line.run([prune] { return run_prune(*prune); });
}

struct VerifyCommand {
  std::string place;  ///< a folder, or the address of a mirror
  std::string trust;  ///< file of the public key that devices are given
  bool json = false;
};

std::string verify_json(const VerifyReport& report) {
  const Json damaged = Json::list(report.damaged, [&](const DamagedObject& object) -> Json {
    return {{"path", object.path}, {"bundle", object.bundle}, {"cause", object.cause}};
  });
  return Json({{"version", report.release.version},
               {"epoch", report.release.epoch},
               {"expires", time_text(report.release.expires)},
               {"key", to_hex(report.key.id)},
               {"bundles", report.release.bundles.size()},
               {"objects", report.objects},
               {"bytes", report.bytes},
               {"damaged", damaged}})
      .dump();
}

Result<ExitCode> run_verify(const VerifyCommand& command) {
  MODAR_ASSIGN(const auto key, read_trust(command.trust));
  MODAR_ASSIGN(const auto read, is_web_address(command.place)
                                    ? web_reader(command.place)
                                    : Result<ReleaseReader>(read_release_folder(command.place)));
  ProgressBar bar(command.json);
  auto verified = verify_release(read, key, [&](double done) { bar.show("verify", done); });
  bar.clear();
  MODAR_ASSIGN(const VerifyReport report, std::move(verified));
  if (command.json) std::fputs(verify_json(report).c_str(), stdout);
  for (const DamagedObject& object : report.damaged) {
    std::fprintf(stderr, "%s: %s; the bundle %s needs it\n", object.path.c_str(),
                 object.cause.c_str(), object.bundle.c_str());
  }
  if (!report.damaged.empty()) {
    return fail(ExitCode::kInvalidInput, "ship.damaged", command.place,
                std::to_string(report.damaged.size()) + " of " + std::to_string(report.objects) +
                    " objects are damaged",
                "remove them and publish their bundles again, or copy them again");
  }
  if (!command.json) {
    std::fprintf(stderr, "release %llu is complete: %zu bundles, %llu objects, %s; %s\n",
                 static_cast<unsigned long long>(report.release.version),
                 report.release.bundles.size(), static_cast<unsigned long long>(report.objects),
                 human_bytes(report.bytes).c_str(), expiry_text(report.release.expires).c_str());
  }
  return ExitCode::kOk;
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
  line.run([verify] { return run_verify(*verify); });
}

struct PlanCommand {
  std::string old_bundle;
  std::string new_bundle;
  std::string link = "2g";
  std::string device;
  RecipeOptions recipe;
  bool json = false;
};

std::string plan_json(const UpdatePlan& plan, const Link& link, const std::string& device,
                      double minutes) {
  const Json json = {{"link", link.name},
                     {"link_source", link.source},
                     {"device", device},
                     {"full_bytes", plan.full_bytes},
                     {"update_bytes", plan.update_bytes},
                     {"update_pieces", plan.update_pieces},
                     {"transfer_seconds", plan.transfer_s},
                     {"install_seconds", plan.install_s},
                     {"geometry_bytes", plan.geometry_bytes},
                     {"geometry_instructions_per_byte", kGeometryInstructions},
                     {"other_bytes", plan.other_bytes},
                     {"other_instructions_per_byte", kOtherInstructions},
                     {"minutes", minutes},
                     {"storage_bytes", plan.storage_bytes}};
  return json.dump();
}

Result<ExitCode> run_plan(const PlanCommand& command) {
  const Link* link = find_link(command.link);
  if (link == nullptr) {
    return fail(ExitCode::kUsage, "ship.link", command.link, "there is no such network",
                "choose from 2g, 3g, 4g, wifi");
  }
  const DeviceProfile* device =
      command.device.empty() ? nullptr : find_device_profile(command.device);
  if (!command.device.empty() && device == nullptr) {
    return fail(ExitCode::kUsage, "ship.device", command.device, "there is no such device profile",
                "choose from " + device_profile_names());
  }
  MODAR_ASSIGN(const auto plan,
               plan_update(command.old_bundle, command.new_bundle, *link, command.recipe));
  const double minutes = (plan.transfer_s + plan.install_s) / 60;
  if (command.json) {
    std::fputs(plan_json(plan, *link, command.device, minutes).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::printf("update: %s in %u pieces (everything: %s)\n", human_bytes(plan.update_bytes).c_str(),
              plan.update_pieces, human_bytes(plan.full_bytes).c_str());
  std::printf("%s: %.1f minutes (%.0f s on the network, %.0f s to install)\n", link->name, minutes,
              plan.transfer_s, plan.install_s);
  std::printf(
      "time to install: assumes %.0f instructions a byte of geometry (%s) and %.0f a byte of the "
      "rest "
      "(%s), as counted on x86-64, 800 million instructions a second and flash that writes 8 "
      "MB/s\n",
      kGeometryInstructions, human_bytes(plan.geometry_bytes).c_str(), kOtherInstructions,
      human_bytes(plan.other_bytes).c_str());
  std::printf("free space that it needs: %s\n", human_bytes(plan.storage_bytes).c_str());
  return ExitCode::kOk;
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
  line.run([plan] { return run_plan(*plan); });
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
