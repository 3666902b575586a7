#include "bake/ship/publish.hpp"

#include <filesystem>

#include "bake/ship/release_folder.hpp"
#include "formats/check.hpp"
#include "modar/mapped_file.hpp"
#include "modar/release.hpp"

namespace modar {
namespace {

/// A good bundle, mapped.
struct OpenBundle {
  MappedFile file;
  BundleView view;
};

Result<OpenBundle> open_bundle(const std::string& path) {
  MODAR_ASSIGN(auto file, MappedFile::open(path));
  if (const std::string error = first_error(file.bytes()); !error.empty()) {
    return fail(ExitCode::kInvalidInput, "ship.bad-bundle", path, error,
                "see `modar check " + path + "`, and bake it again");
  }
  MODAR_ASSIGN(const auto view, BundleView::open(file.bytes()));
  return OpenBundle{std::move(file), view};
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

Result<std::uint64_t> next_version(const ReleaseFolder& folder, std::uint64_t wanted) {
  const auto versions = folder.versions();
  const std::uint64_t newest = versions.empty() ? 0 : versions.back();
  if (wanted == 0) return newest + 1;
  if (wanted > newest) return wanted;
  return fail(ExitCode::kUsage, "ship.version", std::to_string(wanted),
              "release " + std::to_string(newest) + " was published already",
              "choose a greater number, or none");
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
/// Assumed, not measured on a phone: bytes of the bundle a second that an 800 MHz Cortex-A9
/// decodes, hashes and checks, and that flash of its class writes.
constexpr double kInstallBytesPerSecond = 4e6;
constexpr double kFlashBytesPerSecond = 8e6;

}  // namespace

Result<PublishReport> publish(const PublishRequest& request, const SecretKey& key, Report& report) {
  MODAR_ASSIGN(auto folder, ReleaseFolder::open(request.folder));
  PublishReport done;
  MODAR_ASSIGN(const auto version, next_version(folder, request.version));
  done.release.version = version;
  done.release.expires = request.expires;
  for (const std::string& path : request.bundles) {
    StageTimer timer(report, "publish " + path);
    MODAR_ASSIGN(const auto bundle, open_bundle(path));
    MODAR_ASSIGN(const auto made, make_recipe(bundle.view, request.recipe));
    MODAR_ASSIGN(const auto added, folder.add_objects(made));
    done.added_bytes += added;
    const std::string name = std::filesystem::path(path).stem().string();
    done.release.bundles.push_back(describe(name, made));
    if (const auto devices = request.devices.find(name); devices != request.devices.end()) {
      done.release.bundles.back().devices = devices->second;
    }
    for (const auto& [form, totals] : made.forms) {
      done.forms[form].pieces += totals.pieces;
      done.forms[form].raw_bytes += totals.raw_bytes;
      done.forms[form].stored_bytes += totals.stored_bytes;
    }
    timer.done(bundle.view.bytes().size(), made.download_size);
  }
  // A document that devices would refuse is not published.
  if (const auto readable = parse_release(release_text(done.release)); !readable) {
    return fail(ExitCode::kInvalidInput, "ship.name", request.folder, readable.error().cause,
                "name each bundle's file with letters, digits, '.', '_' and '-', no two alike");
  }
  MODAR_TRY(folder.add_release(done.release, key));
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
                               const Link& link, const DeviceProfile* device,
                               const RecipeOptions& options) {
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
  const auto size = static_cast<double>(after.view.bytes().size());
  const double cores = device == nullptr ? 1 : device->cores;
  plan.install_s =
      size / (kInstallBytesPerSecond * std::max(1.0, cores / 2)) + size / kFlashBytesPerSecond;
  plan.storage_bytes = after.view.bytes().size() + plan.update_bytes;
  return plan;
}

}  // namespace modar
