#include "bake/ship/publish.hpp"

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <set>

#include "bake/io/input.hpp"
#include "bake/io/output.hpp"
#include "bake/ship/release_folder.hpp"
#include "formats/base/ranges.hpp"
#include "formats/check.hpp"
#include "modar/mapped_file.hpp"
#include "modar/release.hpp"

namespace modar {
namespace {

/// A good bundle, without what releases leave out.
struct OpenBundle {
  MappedFile file;
  std::vector<std::byte> trimmed;  ///< instead of the file
  BundleView view;
};

Result<OpenBundle> open_bundle(const std::string& path) {
  MODAR_ASSIGN(auto file, MappedFile::open(path));
  MODAR_TRY(require_kind(FileKind::kBundle, path));
  if (const std::string error = first_error(file.bytes()); !error.empty()) {
    return fail(ExitCode::kInvalidInput, "ship.bad-bundle", path, error,
                "see `modar check " + path + "`, and bake it again");
  }
  MODAR_ASSIGN(auto view, BundleView::open(file.bytes()));
  MODAR_ASSIGN(auto trimmed, trim_to_publish(view));
  if (!trimmed.empty()) {
    MODAR_ASSIGN(view, BundleView::open(trimmed));
  }
  return OpenBundle{std::move(file), std::move(trimmed), view};
}

ReleaseBundle describe(const std::string& name, const PublishedBundle& made) {
  ReleaseBundle bundle;
  bundle.name = name;
  bundle.recipe = made.recipe_id;
  bundle.recipe_size = static_cast<std::uint32_t>(made.recipe_object.size());
  bundle.recipe_raw_size = static_cast<std::uint32_t>(made.recipe.size());
  bundle.download_size = made.download_size;
  const auto recipe = open_recipe(made.recipe);
  bundle.size = recipe->header.bundle_size;
  bundle.pieces = recipe->header.piece_count;
  std::copy_n(recipe->header.bundle_hash, bundle.hash.size(), bundle.hash.begin());
  return bundle;
}

/// Numbers begin anew in each epoch, but no document is written over.
Result<std::uint64_t> next_version(const ReleaseFolder& folder, std::uint64_t epoch,
                                   std::uint64_t wanted) {
  std::uint64_t newest = 0;  // of the epoch
  std::set<std::uint64_t> taken;
  for (const std::uint64_t version : folder.versions()) {
    taken.insert(version);
    const auto release = folder.release(version);
    if (release && release->epoch == epoch) newest = std::max(newest, version);
  }
  if (wanted == 0) {
    wanted = newest + 1;
    while (taken.contains(wanted)) ++wanted;
    return wanted;
  }
  if (wanted > newest && !taken.contains(wanted)) return wanted;
  return fail(ExitCode::kUsage, "ship.version", std::to_string(wanted),
              "release " + std::to_string(std::max(newest, taken.contains(wanted) ? wanted : 0)) +
                  " was published already",
              "choose a higher number, or none");
}

const ReleaseBundle* find_bundle(const std::vector<ReleaseBundle>& bundles,
                                 const std::string& name) {
  for (const ReleaseBundle& bundle : bundles) {
    if (bundle.name == name) return &bundle;
  }
  return nullptr;
}

/// The bundles of the release before, without the dropped ones. Errors: kUsage "ship.drop".
Result<std::vector<ReleaseBundle>> kept_bundles(const std::vector<ReleaseBundle>& before,
                                                const PublishRequest& request) {
  std::vector<ReleaseBundle> kept = before;
  for (const std::string& name : request.drop) {
    const ReleaseBundle* bundle = find_bundle(kept, name);
    if (bundle == nullptr) {
      return fail(ExitCode::kUsage, "ship.drop", name, "the newest release has no such bundle",
                  "see `modar ship list --to " + request.folder + "`");
    }
    kept.erase(kept.begin() + (bundle - kept.data()));
  }
  return kept;
}

std::string name_of(const std::string& path) {
  return std::filesystem::path(path).stem().string();
}

/// Before the first one is packed, which takes long. Errors: kUsage "ship.name"; those of
/// reading them.
Result<void> check_bundles(const PublishRequest& request) {
  std::set<std::string> names;
  for (const std::string& path : request.bundles) {
    if (!is_plain_name(name_of(path))) {
      return fail(ExitCode::kUsage, "ship.name", path,
                  "a release names bundles with A-Z a-z 0-9 . _ - only, up to 100 of them",
                  "rename the file");
    }
    if (!names.insert(lower_case(name_of(path))).second) {
      return fail(ExitCode::kUsage, "ship.name", path,
                  "two bundles have this name, or names that differ by case only",
                  "rename one: a phone's storage may ignore case");
    }
    MODAR_TRY(open_bundle(path));
  }
  return {};
}

/// Will there be the bundles whose devices the request names? Errors: kUsage "ship.for".
Result<void> check_devices(const PublishRequest& request, const std::vector<ReleaseBundle>& kept) {
  for (const auto& [name, devices] : request.devices) {
    const bool published = ranges::any_of(
        request.bundles,
        [called = name](const std::string& path) { return name_of(path) == called; });
    if (!published && find_bundle(kept, name) == nullptr) {
      return fail(ExitCode::kUsage, "ship.for", name, "the release has no such bundle",
                  "name one that it has");
    }
  }
  return {};
}

std::vector<BundleChange> changes_between(const std::vector<ReleaseBundle>& before,
                                          const std::vector<ReleaseBundle>& after) {
  std::vector<BundleChange> changes;
  for (const ReleaseBundle& bundle : after) {
    const ReleaseBundle* old = find_bundle(before, bundle.name);
    const bool same = old != nullptr && old->hash == bundle.hash && old->devices == bundle.devices;
    changes.push_back({old == nullptr ? BundleChange::Kind::kAdded
                       : same         ? BundleChange::Kind::kKept
                                      : BundleChange::Kind::kChanged,
                       bundle.name});
  }
  for (const ReleaseBundle& bundle : before) {
    if (find_bundle(after, bundle.name) == nullptr) {
      changes.push_back({BundleChange::Kind::kDropped, bundle.name});
    }
  }
  ranges::sort(changes, {}, &BundleChange::name);
  return changes;
}

/// Makes the pieces of the request's bundles and puts them into the release.
Result<void> add_bundles(const PublishRequest& request, const ReleaseFolder& folder,
                         ObjectLedger& ledger, PublishReport& done, Report& report) {
  for (const std::string& path : request.bundles) {
    StageTimer timer(report, "publish " + path);
    MODAR_ASSIGN(const auto bundle, open_bundle(path));
    MODAR_ASSIGN(const auto made, bundle.file.settle(make_recipe(bundle.view, request.recipe)));
    if (!request.dry_run) {
      MODAR_ASSIGN(const auto added, folder.add_objects(made, ledger));
      done.added_bytes += added;
    }
    const std::string name = name_of(path);
    ReleaseBundle described = describe(name, made);
    auto& bundles = done.release.bundles;
    if (const ReleaseBundle* old = find_bundle(bundles, name)) {
      described.devices = old->devices;  // unless --for says otherwise
      bundles.erase(bundles.begin() + (old - bundles.data()));
    }
    bundles.push_back(std::move(described));
    for (const auto& [form, totals] : made.forms) {
      done.forms[form].pieces += totals.pieces;
      done.forms[form].raw_bytes += totals.raw_bytes;
      done.forms[form].stored_bytes += totals.stored_bytes;
    }
    timer.done(bundle.view.bytes().size(), made.download_size);
  }
  return {};
}

/// Hashes what the release keeps of the one before: what rots on the server would fail on every
/// device. Those that the request names were written by add_bundles().
Result<void> check_kept(const PublishRequest& request, const ReleaseFolder& folder,
                        const Release& release, ObjectLedger& ledger) {
  std::set<std::string> written;
  for (const std::string& path : request.bundles) {
    written.insert(name_of(path));
  }
  for (const ReleaseBundle& bundle : release.bundles) {
    if (!written.contains(bundle.name)) MODAR_TRY(folder.check_objects(bundle, ledger));
  }
  return ledger.save();
}

// Rates and delays that browsers' tools and WebPageTest use for these networks.
constexpr std::array<Link, 4> kLinks = {
    {{"2g", 280e3, 0.8, "WebPageTest profile 2G: 280 kbit/s down, 800 ms"},
     {"3g", 1.6e6, 0.3, "WebPageTest profile 3G: 1.6 Mbit/s down, 300 ms"},
     {"4g", 9e6, 0.17, "WebPageTest profile 4G: 9 Mbit/s down, 170 ms"},
     {"wifi", 30e6, 0.04, "a shared access point: 30 Mbit/s down, 40 ms"}}};

/// Headers of a request and its answer.
constexpr double kRequestBytes = 500;
constexpr double kRequestsAtOnce = 4;
/// Assumed, not measured on a phone: an 800 MHz Cortex-A9 at one instruction a cycle, and what
/// flash of its class writes.
constexpr double kInstructionsPerSecond = 800e6;
constexpr double kFlashBytesPerSecond = 8e6;

bool is_geometry(PieceForm form) {
  return form == PieceForm::kMesh || form == PieceForm::kLevel;
}

}  // namespace

const char* to_string(BundleChange::Kind kind) {
  constexpr const char* kNames[] = {"added", "changed", "kept", "dropped"};
  return kNames[static_cast<std::size_t>(kind)];
}

Result<PublishReport> publish(const PublishRequest& request, const SecretKey& key, Report& report) {
  if (request.bundles.empty() && request.drop.empty() && request.devices.empty()) {
    return fail(ExitCode::kUsage, "ship.nothing", request.folder, "there is nothing to publish",
                "name bundles, or --drop NAME");
  }
  MODAR_TRY(check_bundles(request));
  std::error_code absent;
  if (request.bundles.empty() && !std::filesystem::exists(request.folder, absent)) {
    return fail(ExitCode::kUsage, "ship.nothing", request.folder, "there is no release in it",
                "name the folder of a release, or bundles for a new one");
  }
  MODAR_ASSIGN(const auto folder, ReleaseFolder::open(request.folder, request.force));
  MODAR_TRY(folder.check_signer(key.public_key));
  MODAR_ASSIGN(const auto newest, folder.newest());
  const std::vector<ReleaseBundle> before = newest ? newest->bundles : std::vector<ReleaseBundle>();
  PublishReport done;
  MODAR_ASSIGN(const RootMetadata word, folder.root_metadata());
  done.release.epoch = word.epoch;
  MODAR_ASSIGN(done.release.version, next_version(folder, word.epoch, request.version));
  done.release.expires = request.expires;
  done.release.fresh_days = request.fresh_days.value_or(newest ? newest->fresh_days : 0);
  MODAR_ASSIGN(done.release.bundles, kept_bundles(before, request));
  MODAR_TRY(check_devices(request, done.release.bundles));
  if (request.bundles.empty() && done.release.bundles.empty()) {
    return fail(ExitCode::kUsage, "ship.nothing", request.folder, "no bundle would be left in it",
                "publish another bundle with --drop, or remove the folder");
  }
  ObjectLedger ledger(request.folder);
  MODAR_TRY(add_bundles(request, folder, ledger, done, report));
  for (const auto& [name, devices] : request.devices) {
    for (ReleaseBundle& bundle : done.release.bundles) {
      if (bundle.name == name) bundle.devices = devices;
    }
  }
  ranges::sort(done.release.bundles, {}, &ReleaseBundle::name);
  done.changes = changes_between(before, done.release.bundles);
  // A document that devices would refuse is not published.
  if (const std::size_t size = release_text(done.release).size(); size > kMaxReleaseBytes) {
    return fail(ExitCode::kUnsupported, "ship.too-many", request.folder,
                std::to_string(done.release.bundles.size()) + " bundles make a document of " +
                    std::to_string(size) + " bytes; devices read " +
                    std::to_string(kMaxReleaseBytes),
                "publish them into several folders");
  }
  if (const auto readable = parse_release(release_text(done.release)); !readable) {
    return fail(
        ExitCode::kUsage, "ship.name", request.folder, readable.error().cause,
        "name each bundle's file with letters, digits, '.', '_' and '-', no two of them equal");
  }
  if (request.dry_run) return done;
  MODAR_TRY(check_kept(request, folder, done.release, ledger));
  MODAR_TRY(folder.add_release(done.release, std::time(nullptr), key));
  return done;
}

std::span<const Link> links() {
  return kLinks;
}

const Link* find_link(std::string_view name) {
  for (const Link& link : kLinks) {
    if (name == link.name) return &link;
  }
  return nullptr;
}

Result<UpdatePlan> plan_update(const std::string& old_bundle, const std::string& new_bundle,
                               const Link& link, const RecipeOptions& options) {
  MODAR_ASSIGN(const auto before, open_bundle(old_bundle));
  MODAR_ASSIGN(const auto after, open_bundle(new_bundle));
  MODAR_ASSIGN(const auto old_recipe, make_recipe(before.view, options));
  MODAR_ASSIGN(const auto new_recipe, make_recipe(after.view, options));

  UpdatePlan plan;
  Release release;
  release.version = 1;
  release.bundles.push_back(describe("bundle", new_recipe));
  const std::uint64_t documents = release_text(release).size() + new_recipe.recipe_object.size();
  plan.full_bytes = release_text(release).size() + new_recipe.download_size;
  plan.update_bytes = documents;
  for (const auto& [id, object] : new_recipe.objects) {
    if (old_recipe.objects.contains(id)) continue;
    plan.update_bytes += object.size();
    ++plan.update_pieces;
  }
  // Four documents come one after another, the pieces side by side.
  const double requests = 4 + plan.update_pieces / kRequestsAtOnce;
  plan.transfer_s =
      (static_cast<double>(plan.update_bytes) + kRequestBytes * (4.0 + plan.update_pieces)) * 8 /
          link.bits_per_second +
      requests * link.round_trip_s;
  for (const auto& [form, totals] : new_recipe.forms) {
    (is_geometry(form) ? plan.geometry_bytes : plan.other_bytes) += totals.raw_bytes;
  }
  const auto size = static_cast<double>(after.view.bytes().size());
  plan.install_s = (static_cast<double>(plan.geometry_bytes) * kGeometryInstructions +
                    static_cast<double>(plan.other_bytes) * kOtherInstructions) /
                       kInstructionsPerSecond +
                   size / kFlashBytesPerSecond;
  plan.storage_bytes = after.view.bytes().size() + plan.update_bytes;
  return plan;
}

}  // namespace modar
