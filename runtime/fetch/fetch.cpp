// From the server's newest release to the release in use (formats/shipping.md).
#include "modar/fetch.hpp"

#include <algorithm>
#include <ctime>
#include <optional>
#include <tuple>
#include <utility>

#include "install.hpp"

namespace modar {
namespace fetch {
namespace {

// --- Trust ---

constexpr std::size_t kMaxSignatureBytes = 4096;
constexpr std::size_t kMaxLinkBytes = 4096;
constexpr std::size_t kMaxLatestBytes = 32;
constexpr std::uint32_t kMaxLinks = 1000;

/// A signed document of the chain of trust. Errors: "fetch.missing" where the server has none.
struct TrustDocument {
  std::string text;
  Signature signature;
};

Result<TrustDocument> download_trust(Transfers& transfers, const std::string& path) {
  TrustDocument document;
  MODAR_ASSIGN(document.text, transfers.text(path, kMaxLinkBytes, true));
  MODAR_ASSIGN(const auto signature_text, transfers.text(path + ".minisig", kMaxSignatureBytes));
  MODAR_ASSIGN(document.signature, parse_signature(signature_text));
  return document;
}

using KeyId = std::array<std::uint8_t, 8>;

/// What this device believes, and how it came to it.
struct TrustState {
  const Store& store;
  StoreState state;
  /// Both copies of the state are gone though a release is installed: nothing is saved before a
  /// document has been held against that release.
  bool lost = false;
  std::vector<KeyId> passed;  ///< keys that the chain led through

  Result<void> save() const { return lost ? Result<void>() : store.save_state(state); }
};

/// A text that the server need not have.
Result<std::optional<std::string>> download_optional(Transfers& transfers, const std::string& path,
                                                     std::size_t limit) {
  auto text = transfers.text(path, limit, true);
  if (text) return std::optional<std::string>(std::move(*text));
  if (text.error().code == "fetch.missing") return std::optional<std::string>();
  return tl::unexpected(text.error());
}

/// The root keys that count now: those of --trust, and where the chain of root keys leads from
/// them. What verifies is saved at once: a set that was left is not believed again.
Result<RootSet> verify_root_rotations(Transfers& transfers, TrustState& trust) {
  StoreState& state = trust.state;
  MODAR_ASSIGN(auto roots, parse_root_set(state.roots.empty() ? state.root_key : state.roots));
  const SignatureReader read = [&](const std::string& path) {
    return download_optional(transfers, path, kMaxSignatureBytes);
  };
  while (state.root_serial < kMaxLinks) {
    const std::string path = root_rotation_path(state.root_serial + 1);
    MODAR_ASSIGN(const auto text, download_optional(transfers, path, kMaxLinkBytes));
    if (!text) break;
    MODAR_TRY(verify_root_signatures(path, *text, roots, read));
    MODAR_ASSIGN(auto link, parse_root_rotation(*text));
    if (link.serial != state.root_serial + 1) {
      return fail(kExitMixed, "fetch.chain", path, "it is a different link of the chain",
                  "publish the chain of root keys again");
    }
    MODAR_TRY(verify_root_signatures(path, *text, link.roots, read));
    roots = std::move(link.roots);
    state.roots = root_set_line(roots);
    state.root_serial = link.serial;
    MODAR_TRY(trust.save());
  }
  return roots;
}

/// Believes the root metadata if there is a newer one than the state knows. Only the root keys sign
/// it, so no thief of a signing key can stop or forge it.
Result<void> follow_root(Transfers& transfers, TrustState& trust) {
  StoreState& state = trust.state;
  MODAR_ASSIGN(const auto roots, verify_root_rotations(transfers, trust));
  const std::string path = "root.json";
  MODAR_ASSIGN(const auto text, download_optional(transfers, path, kMaxLinkBytes));
  if (!text && !state.trusted_key.empty()) return {};
  if (!text) {
    return fail(kExitWrongKey, "fetch.no-root", path,
                "the server names no signing key, and root keys do not sign releases",
                "name the key that signs: `modar ship root`");
  }
  if (roots.keys.size() == 1) {
    MODAR_ASSIGN(const auto signature_text, transfers.text(path + ".minisig", kMaxSignatureBytes));
    MODAR_ASSIGN(const auto signature, parse_signature(signature_text));
    MODAR_TRY(verify_signature(*text, signature, roots.keys.front()));
  } else {
    MODAR_TRY(verify_root_signatures(path, *text, roots, [&](const std::string& signature) {
      return download_optional(transfers, signature, kMaxSignatureBytes);
    }));
  }
  MODAR_ASSIGN(const auto word, parse_root_metadata(*text));
  if (word.epoch <= state.epoch) return {};  // known, or replayed
  MODAR_ASSIGN(const auto key, parse_public_key(word.key));
  state.trusted_key = public_key_line(key);
  state.epoch = word.epoch;
  state.key_serial = word.links;
  state.version = 0;
  return trust.save();
}

/// Moves the trust along the chain of keys until `target` is trusted; to the chain's end where the
/// state is fresh, so that a key that was left behind is not believed again. What verifies is saved
/// at once.
Result<void> follow_chain(Transfers& transfers, const Signature& target, TrustState& trust) {
  StoreState& state = trust.state;
  MODAR_ASSIGN(auto trusted, parse_public_key(state.trusted_key));
  while ((state.fresh || trusted.id != target.key_id) && state.key_serial < kMaxLinks) {
    const std::uint32_t serial = state.key_serial + 1;
    const std::string path = "keys/" + std::to_string(serial) + ".json";
    const auto document = download_trust(transfers, path);
    if (!document && document.error().code == "fetch.missing") break;
    if (!document) return tl::unexpected(document.error());
    state.key_serial = serial;
    // A device that joined in the middle passes over the links before its key.
    if (document->signature.key_id != trusted.id) continue;
    MODAR_TRY(verify_signature(document->text, document->signature, trusted));
    MODAR_ASSIGN(const auto link, parse_key_rotation(document->text));
    if (link.serial != serial) {
      return fail(kExitMixed, "fetch.chain", path, "it is a different link of the chain",
                  "publish the chain of keys again");
    }
    trust.passed.push_back(trusted.id);
    MODAR_ASSIGN(trusted, parse_public_key(link.key));
    state.trusted_key = public_key_line(trusted);
    MODAR_TRY(trust.save());
  }
  trust.passed.push_back(trusted.id);
  return {};  // where the end of the chain is not `target`, the signature check reports it
}

/// Puts the key that --trust gives into the state, unless the state knows where the chain of keys
/// has led from it. Errors: kInvalidInput "key.public".
Result<void> recall_trust(const std::string& given_key, StoreState& state) {
  MODAR_ASSIGN(const auto given, parse_root_set(given_key));
  const std::string line = root_set_line(given);
  if (line == state.root_key || line == state.trusted_key || line == state.roots) return {};
  state = {};
  state.root_key = line;
  if (given.keys.size() == 1) state.trusted_key = line;
  return {};
}

/// The Freshness of a release that has one, into `offered`. Errors: kExitMixed "fetch.mixed";
/// kExitExpired "fetch.stale"; as download_release().
Result<void> check_freshness(Transfers& transfers, const PublicKey& trusted, std::int64_t clock,
                             StoreState& state, SignedRelease& offered) {
  if (offered.release.fresh_days == 0) return {};
  const std::string path = freshness_path(offered.release.version);
  MODAR_ASSIGN(offered.fresh_text, transfers.text(path, kMaxLinkBytes));
  MODAR_ASSIGN(const auto signature_text, transfers.text(path + ".minisig", kMaxSignatureBytes));
  MODAR_ASSIGN(const auto signature, parse_signature(signature_text));
  MODAR_TRY(verify_signature(offered.fresh_text, signature, trusted));
  MODAR_ASSIGN(const auto fresh, parse_freshness(offered.fresh_text));
  if (fresh.version != offered.release.version || fresh.epoch != offered.release.epoch) {
    return fail(kExitMixed, "fetch.mixed", path, "it refers to another release",
                "sign it again: `modar ship refresh`");
  }
  if (fresh.expires <= clock) {
    return fail(
        kExitExpired, "fetch.stale", path,
        "nobody has confirmed since " + time_text(fresh.time) + " that this release is the newest",
        "sign it again: `modar ship refresh`, or correct this device's clock");
  }
  state.time = std::max(state.time, fresh.time);
  return {};
}

/// The server's newest release. Where another key than the trusted one has signed it, asks for the
/// root metadata and follows the chain of keys.
/// Errors: kExitWrongKey; kExitMixed; kExitNetwork; kInvalidInput "release.*".
Result<SignedRelease> download_release(Transfers& transfers, std::int64_t clock,
                                       TrustState& trust) {
  StoreState& state = trust.state;
  MODAR_ASSIGN(const auto latest, transfers.text("latest", kMaxLatestBytes));
  MODAR_ASSIGN(const auto version, parse_latest(latest));
  const std::string path = "releases/" + std::to_string(version) + ".json";
  SignedRelease offered;
  MODAR_ASSIGN(auto text, transfers.text(path, kMaxReleaseBytes));
  MODAR_ASSIGN(auto signature_text, transfers.text(path + ".minisig", kMaxSignatureBytes));
  offered.text = std::move(text);
  offered.signature_text = std::move(signature_text);
  MODAR_ASSIGN(const auto signature, parse_signature(offered.signature_text));
  const auto before = parse_public_key(state.trusted_key);  // none: no root metadata is known yet
  if (state.fresh || !before || before->id != signature.key_id) {
    MODAR_TRY(follow_root(transfers, trust));
    MODAR_TRY(follow_chain(transfers, signature, trust));
  }
  MODAR_ASSIGN(const auto trusted, parse_public_key(state.trusted_key));
  MODAR_TRY(verify_signature(offered.text, signature, trusted));
  MODAR_ASSIGN(auto release, parse_release(offered.text));
  if (release.version != version) {
    return fail(kExitMixed, "fetch.mixed", path, "it is release " + std::to_string(release.version),
                "publish the release again");
  }
  offered.release = std::move(release);
  MODAR_TRY(check_freshness(transfers, trusted, clock, state, offered));
  return offered;
}

// --- What this device wants ---

TransferOptions transfer_options(const FetchOptions& options, const std::string& installed) {
  TransferOptions transfer;
  transfer.url = options.url;
  transfer.parallel = options.parallel;
  transfer.bytes_per_second = options.bytes_per_second;
  transfer.attempts = options.attempts;
  transfer.first_wait_s = options.first_wait_s;
  transfer.stall_s = options.stall_s;
  transfer.authorities = options.authorities;
  transfer.source = options.source;
  transfer.needs = options.needs;
  transfer.waiting = options.waiting;
  transfer.user_agent = "modar-fetch/" MODAR_VERSION " (" + installed + ")";
  return transfer;
}

/// Refuses a release that is older than the installed one or than `least` (epoch, version), has
/// expired, or differs from the installed one of the same number.
Result<void> check_release(const SignedRelease& offered, const StoreState& state,
                           const std::optional<InstalledRelease>& active, std::int64_t now,
                           const std::pair<std::uint64_t, std::uint64_t>& least) {
  // The active release counts too, in case the state was lost; not one of an epoch before.
  const bool counts = active && active->release.epoch == state.epoch;
  const std::uint64_t known =
      std::max(state.version, counts ? active->release.version : std::uint64_t{0});
  const std::string where = "release " + std::to_string(offered.release.version);
  if (offered.release.epoch != state.epoch) {
    return fail(offered.release.epoch < state.epoch ? kExitRollBack : kExitMixed, "fetch.epoch",
                where,
                "it is of epoch " + std::to_string(offered.release.epoch) +
                    ", the root key's word of epoch " + std::to_string(state.epoch),
                "publish it again");
  }
  if (std::tie(offered.release.epoch, offered.release.version) <
      std::tie(least.first, least.second)) {
    return fail(kExitRollBack, "fetch.roll-back", where,
                "release " + std::to_string(least.second) + " came with this program",
                "publish it under a higher number");
  }
  if (offered.release.version < known) {
    return fail(kExitRollBack, "fetch.roll-back", where,
                "release " + std::to_string(known) + " was installed before",
                "publish it under a higher number");
  }
  if (offered.release.expires != kNever && offered.release.expires <= now) {
    return fail(kExitExpired, "fetch.expired", where,
                "it expired at " + time_text(offered.release.expires),
                "publish it again, or correct this device's clock");
  }
  if (counts && active->release.version == offered.release.version &&
      active->text != offered.text) {
    return fail(kExitMixed, "fetch.same-number", where,
                "another release was installed under this number",
                "publish it under a higher number");
  }
  return {};
}

/// Where the state was lost, the installed release states the trusted values: no epoch before its
/// own, and in its epoch no keys that do not lead past the one that signed it.
Result<void> check_lost_state(const SignedRelease& offered, const TrustState& trust,
                              const std::optional<InstalledRelease>& installed) {
  if (!trust.lost || !installed || offered.release.epoch > installed->release.epoch) return {};
  const std::string where = "release " + std::to_string(offered.release.version);
  if (offered.release.epoch < installed->release.epoch) {
    return fail(kExitRollBack, "fetch.epoch", where,
                "it is of epoch " + std::to_string(offered.release.epoch) +
                    ", the installed one of " + std::to_string(installed->release.epoch),
                "publish it again; for another publisher, name another store");
  }
  const auto text = installed->folder.read("release.json.minisig", kMaxSignatureBytes);
  const auto signature = parse_signature(text.value_or(""));
  const bool led = !signature || std::find(trust.passed.begin(), trust.passed.end(),
                                           signature->key_id) != trust.passed.end();
  if (led) return {};
  return fail(kExitWrongKey, "fetch.retired", where,
              "the server's keys do not lead to " + to_hex(signature->key_id) +
                  ", which signed the installed release",
              "publish the chain of keys again; for another publisher, name another store");
}

/// The time, as late as is known: clocks of devices start in 1970 without a battery.
std::int64_t clock_of(const FetchOptions& options, const StoreState& state,
                      const std::optional<InstalledRelease>& active) {
  // kNotBefore: the day of this program's last commit.
#include "commit_day.inc"
  std::int64_t clock = options.now != 0 ? options.now : std::int64_t{std::time(nullptr)};
  clock = std::max({clock, kNotBefore, state.time});
  const auto text = active ? active->folder.read("fresh.json", kMaxLinkBytes) : std::nullopt;
  const auto fresh = parse_freshness(text.value_or(""));
  return fresh ? std::max(clock, fresh->time) : clock;
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
                "it has no bundle for this device, or none of this name",
                "see its bundles in releases/" + std::to_string(release.version) + ".json");
  }
  return chosen;
}

/// Whether every chosen bundle of the release in use is there and intact. Reads them all (BLAKE2b,
/// about 1 GB/s on a desk): a fetch heals what has rotted.
bool is_installed(const InstalledRelease& active, const std::vector<ReleaseBundle>& chosen) {
  return std::all_of(chosen.begin(), chosen.end(),
                     [&](const ReleaseBundle& bundle) { return has_hash(active.folder, bundle); });
}

/// The first damaged bundle of a release, or nothing.
std::optional<Error> find_damage(const InstalledRelease& installed) {
  for (const ReleaseBundle& bundle : installed.release.bundles) {
    if (!installed.folder.size(bundle.name + ".modar")) continue;  // not for this device
    if (auto good = verify_bundle(installed.folder, bundle); !good) return good.error();
  }
  return std::nullopt;
}

}  // namespace
}  // namespace fetch

Result<FetchReport> fetch_release(const FetchOptions& options) {
  using namespace fetch;
  MODAR_ASSIGN(auto store, Store::open(options.store));
  auto active = store.active();
  const std::string installed =
      active ? "release " + std::to_string(active->release.version) : "nothing installed";
  MODAR_ASSIGN(auto transfers, Transfers::create(transfer_options(options, installed)));
  TrustState trust{store, store.state(), false, {}};
  StoreState& state = trust.state;
  trust.lost = state.fresh && active.has_value();
  MODAR_TRY(recall_trust(options.trusted_key, state));
  const std::int64_t known_time = state.time;
  const std::int64_t clock = clock_of(options, state, active);
  MODAR_ASSIGN(const auto offered, download_release(transfers, clock, trust));
  MODAR_TRY(check_lost_state(offered, trust, active));
  MODAR_TRY(
      check_release(offered, state, active, clock, {options.least_epoch, options.least_version}));
  MODAR_ASSIGN(const auto chosen, choose_bundles(offered.release, options));

  FetchReport report;
  report.version = offered.release.version;
  report.changed = !active || active->text != offered.text || !is_installed(*active, chosen);
  if (report.changed) {
    MODAR_TRY(install({options, store, transfers, offered, std::move(active), chosen}, report));
  } else {
    if (!offered.fresh_text.empty() && state.time > known_time) {
      MODAR_TRY(active->folder.replace("fresh.json", offered.fresh_text));
    }
    MODAR_TRY(store.link_bundles(offered.release));
  }
  state.version = offered.release.version;
  MODAR_TRY(store.save_state(state));
  MODAR_TRY(store.remove_pieces({}));
  report.epoch = offered.release.epoch;
  report.expires = offered.release.expires;
  report.blocked = store.blocked_links(offered.release);
  if (const auto now = store.active()) report.bundles = installed_paths(store.folder(), *now);
  report.downloaded_bytes = transfers.stats().bytes;
  report.retries = transfers.stats().retries;
  report.corrupt_pieces += transfers.stats().corrupt;
  return report;
}

Result<StoreReport> verify_store(const std::string& path) {
  using namespace fetch;
  MODAR_ASSIGN(auto store, Store::open(path));
  StoreReport report;
  auto active = store.active();
  if (!active || find_damage(*active)) {
    auto before = store.other();
    if (!before || find_damage(*before)) {
      return fail(kExitBadBundle, "store.damaged", path, "no good release is left in it",
                  "run modar-fetch with the server's address");
    }
    MODAR_TRY(store.activate(*before));
    report.fell_back = true;
    active = std::move(before);
  }
  report.version = active->release.version;
  report.bundles = installed_paths(store.folder(), *active);
  return report;
}

std::optional<StoreReport> installed_release(const std::string& store) {
  using namespace fetch;
  const auto folder = Folder::open(store, false);
  const auto installed = folder ? active_release(*folder) : std::nullopt;
  if (!installed) return std::nullopt;
  return StoreReport{installed->release.version, installed_paths(*folder, *installed), false};
}

std::vector<std::string> previews(const std::string& store) {
  using namespace fetch;
  const auto folder = Folder::open(store, false);
  return folder ? first_paths(*folder, active_release(*folder)) : std::vector<std::string>();
}

}  // namespace modar
