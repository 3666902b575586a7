// Which key a device believes, and the newest release that this key has signed.
#pragma once

#include <string>

#include "modar/release.hpp"
#include "store.hpp"
#include "transfer.hpp"

namespace modar::fetch {

/// A release document whose signature was verified.
struct SignedRelease {
  std::string text;
  std::string signature_text;
  Release release;
};

/// Puts the key that --trust gives into the state, unless the state knows where the chain of keys
/// has led from it. Errors: kInvalidInput "key.public".
Result<void> recall_trust(const std::string& given_key, StoreState& state);

/// The server's newest release. Follows the chain of keys where another key than the trusted one
/// has signed, and moves the state's trust along it.
/// Errors: kExitWrongKey; kExitMixed; kExitNetwork; kInvalidInput "release.*".
Result<SignedRelease> bring_release(Transfers& transfers, StoreState& state);

}  // namespace modar::fetch
