// Looks at what is installed, and falls back where it is damaged.
#include <optional>

#include "assembly.hpp"
#include "modar/fetch.hpp"

namespace modar {
namespace fetch {
namespace {

/// The first bundle of a release that is not what it should be, or nothing.
std::optional<Error> find_damage(const InstalledRelease& installed) {
  for (const ReleaseBundle& bundle : installed.release.bundles) {
    const std::string file = installed.folder + "/" + bundle.name + ".modar";
    if (!file_size(file)) continue;  // not for this device
    if (auto good = verify_bundle(file, bundle); !good) return good.error();
  }
  return std::nullopt;
}

}  // namespace
}  // namespace fetch

Result<StoreReport> verify_store(const std::string& path) {
  using namespace fetch;
  auto store = Store::open(path);
  if (!store) return tl::unexpected(store.error());
  StoreReport report;
  auto active = store->active();
  if (!active || find_damage(*active)) {
    auto before = store->other();
    if (!before || find_damage(*before)) {
      return fail(kExitBadBundle, "store.damaged", path, "no good release is left in it",
                  "run modar-fetch with the server's address");
    }
    if (auto switched = store->activate(*before); !switched) {
      return tl::unexpected(switched.error());
    }
    report.fell_back = true;
    active = std::move(before);
  }
  report.version = active->release.version;
  report.bundles = store->bundle_paths(active->release);
  return report;
}

}  // namespace modar
