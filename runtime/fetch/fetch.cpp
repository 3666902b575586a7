// From the server's release to the release in use, step by step (formats/shipping.md, Fetching).
#include "modar/fetch.hpp"

#include <algorithm>
#include <ctime>

#include "files.hpp"
#include "installation.hpp"
#include "trust.hpp"

namespace modar {
namespace fetch {
namespace {

TransferOptions transfer_options(const FetchOptions& options) {
  TransferOptions transfer;
  transfer.url = options.url;
  transfer.parallel = options.parallel;
  transfer.bytes_per_second = options.bytes_per_second;
  transfer.attempts = options.attempts;
  transfer.first_wait_s = options.first_wait_s;
  transfer.stall_s = options.stall_s;
  return transfer;
}

/// Refuses what is older than what was installed, what is past its time, and what is another
/// release under an old number.
Result<void> judge_release(const SignedRelease& news, const StoreState& state,
                           const std::optional<InstalledRelease>& active) {
  const std::uint64_t known =
      std::max(state.version, active ? active->release.version : std::uint64_t{0});
  const std::string where = "release " + std::to_string(news.release.version);
  if (news.release.version < known) {
    return fail(kExitRollBack, "fetch.roll-back", where,
                "release " + std::to_string(known) + " was installed before",
                "publish under a greater number");
  }
  if (news.release.expires <= std::time(nullptr)) {
    return fail(kExitExpired, "fetch.expired", where,
                "it expired at " + time_text(news.release.expires),
                "publish anew; or set this device's clock");
  }
  if (active && active->release.version == news.release.version && active->text != news.text) {
    return fail(kExitMixed, "fetch.same-number", where,
                "another release was installed under this number",
                "publish under a greater number");
  }
  return {};
}

/// The bundles that this device wants.
Result<std::vector<ReleaseBundle>> choose_bundles(const Release& release,
                                                  const FetchOptions& options) {
  std::vector<ReleaseBundle> chosen;
  const auto contains = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  for (const ReleaseBundle& bundle : release.bundles) {
    if (!options.bundles.empty() && !contains(options.bundles, bundle.name)) continue;
    if (!options.device.empty() && !bundle.devices.empty() &&
        !contains(bundle.devices, options.device)) {
      continue;
    }
    chosen.push_back(bundle);
  }
  if (chosen.empty()) {
    return fail(ExitCode::kUnsupported, "fetch.device",
                "release " + std::to_string(release.version),
                "it holds no bundle for this device or of this name",
                "see its bundles in releases/" + std::to_string(release.version) + ".json");
  }
  return chosen;
}

/// Whether every chosen bundle of the release in use lies there in full length.
bool is_installed(const InstalledRelease& active, const std::vector<ReleaseBundle>& chosen) {
  return std::all_of(chosen.begin(), chosen.end(), [&](const ReleaseBundle& bundle) {
    return file_size(active.folder + "/" + bundle.name + ".modar") == bundle.size;
  });
}

}  // namespace
}  // namespace fetch

Result<FetchReport> fetch_release(const FetchOptions& options) {
  using namespace fetch;
  auto store = Store::open(options.store);
  if (!store) return tl::unexpected(store.error());
  auto transfers = Transfers::create(transfer_options(options));
  if (!transfers) return tl::unexpected(transfers.error());
  StoreState state = store->state();
  if (auto known = recall_trust(options.trusted_key, state); !known) {
    return tl::unexpected(known.error());
  }
  const auto news = bring_release(*transfers, state);
  if (!news) return tl::unexpected(news.error());
  auto active = store->active();
  if (auto fine = judge_release(*news, state, active); !fine) return tl::unexpected(fine.error());
  const auto chosen = choose_bundles(news->release, options);
  if (!chosen) return tl::unexpected(chosen.error());

  FetchReport report;
  report.version = news->release.version;
  report.changed = !active || active->text != news->text || !is_installed(*active, *chosen);
  if (report.changed) {
    if (auto done =
            install({options, *store, *transfers, *news, std::move(active), *chosen}, report);
        !done) {
      return tl::unexpected(done.error());
    }
  } else if (auto linked = store->link_bundles(news->release); !linked) {
    return tl::unexpected(linked.error());
  }
  state.version = news->release.version;
  if (auto saved = store->save_state(state); !saved) return tl::unexpected(saved.error());
  if (auto cleared = empty_folder(store->pieces()); !cleared)
    return tl::unexpected(cleared.error());
  report.bundles = store->bundle_paths(news->release);
  report.downloaded_bytes = transfers->stats().bytes;
  report.retries = transfers->stats().retries;
  report.corrupt_pieces += transfers->stats().corrupt;
  return report;
}

}  // namespace modar
