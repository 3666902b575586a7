// One installation, from the verified document to the switch.
#pragma once

#include <optional>
#include <vector>

#include "modar/fetch.hpp"
#include "store.hpp"
#include "transfer.hpp"
#include "trust.hpp"

namespace modar::fetch {

struct InstallationJob {
  const FetchOptions& options;
  const Store& store;
  Transfers& transfers;
  const SignedRelease& news;
  std::optional<InstalledRelease> active;  ///< whose pieces serve again
  const std::vector<ReleaseBundle>& chosen;
};

/// Builds the release in the spare slot and puts it in use. Errors: those of fetch_release().
Result<void> install(const InstallationJob& job, FetchReport& report);

}  // namespace modar::fetch
