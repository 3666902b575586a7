// One installation, from the verified document to the switch of slots. Internal to runtime/fetch.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "modar/fetch.hpp"
#include "store.hpp"
#include "transfer.hpp"

namespace modar::fetch {

/// A release document whose signature was verified.
struct SignedRelease {
  std::string text;
  std::string signature_text;
  Release release;
  std::string fresh_text;  ///< its Freshness; empty: it has none
};

struct InstallationJob {
  const FetchOptions& options;
  const Store& store;
  Transfers& transfers;
  const SignedRelease& offered;
  std::optional<InstalledRelease> active;  ///< the release in use, whose pieces are reused
  const std::vector<ReleaseBundle>& chosen;
};

/// Builds the release in the spare slot and puts it in use. Errors: those of fetch_release().
Result<void> install(const InstallationJob& job, FetchReport& report);

/// Whether a bundle's file in a slot has its size and signed hash. Reads it once.
bool has_hash(const Folder& slot, const ReleaseBundle& bundle);

/// Checks a bundle's file in a slot against its signed hash and the rules of a good bundle.
/// Errors: kIo; kExitBadBundle "store.hash", "store.rules".
Result<void> verify_bundle(const Folder& slot, const ReleaseBundle& bundle);

}  // namespace modar::fetch
