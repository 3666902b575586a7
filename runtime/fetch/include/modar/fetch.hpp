// Installs releases on the device. `modar-fetch` is this and a command line; an app may call it on
// a thread of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/error.hpp"
#include "modar/release.hpp"

namespace modar {

struct FetchProgress {
  std::uint64_t bytes_done = 0;  ///< of what has to be downloaded
  std::uint64_t bytes_total = 0;
  double seconds_left = -1;  ///< -1: not known yet
};

/// A file that did not come, and will be asked for again.
struct FetchWait {
  std::string address;
  std::string cause;
  unsigned attempt = 0;   ///< the next one, of those in a row without data
  unsigned attempts = 0;  ///< after which it gives up
  double seconds = 0;     ///< until then
};

/// A file that a fetch is about to ask for.
struct FileNeed {
  std::string path;         ///< below the release folder
  std::uint64_t from = 0;   ///< first byte that is wanted
  std::uint64_t limit = 0;  ///< bytes that it has at most, from its first
};

/// For an app with a network stack of its own, asked from the thread that calls fetch_release(),
/// for one file at a time: hands the bytes of the file `path` below the release folder, from byte
/// `from` to its end, to `take` in portions, until that returns false. Errors: kExitMixed
/// "fetch.missing" (no such file); "fetch.later": the app brings the files that it was told of
/// (FetchOptions::needs) and calls again, so this call ends with that error; any other: the fetch
/// tries again.
using ByteSource =
    std::function<Result<void>(const std::string& path, std::uint64_t from,
                               const std::function<bool(std::span<const std::byte>)>& take)>;

struct FetchOptions {
  std::string url;    ///< http://, https://, file:// or a folder that `modar ship publish` filled
  std::string store;  ///< folder of the installed bundles; made where it is missing
  std::string trusted_key;             ///< text of K.pub, or of a file of `modar ship trust`
  std::string device;                  ///< only bundles for this profile; empty: for any
  std::vector<std::string> bundles;    ///< only these; empty: all
  unsigned parallel = 4;               ///< pieces at once
  std::uint64_t bytes_per_second = 0;  ///< cap, not for a ByteSource; 0: none
  unsigned attempts = 8;               ///< in a row without any data, then it gives up
  double first_wait_s = 0.5;           ///< before the second attempt, then twice as long each time
  double stall_s = 30;                 ///< a silent connection is closed after this
  std::string
      authorities;  ///< PEM file for HTTPS; empty: CURL_CA_BUNDLE, SSL_CERT_FILE, the system's
  /// Seconds since 1970, of a caller whose clock goes on where std::time() ends in 2038 (32-bit
  /// devices, WebAssembly); 0: std::time().
  std::int64_t now = 0;
  ByteSource source;  ///< instead of the URL; a library built without libcurl needs it
  /// Told before a source is asked: these files are needed, in this order. May be empty.
  std::function<void(std::span<const FileNeed>)> needs;
  /// Releases before this one are refused (11) as if it had been installed: what came with the app
  /// is of it. 0: none is known.
  std::uint64_t least_epoch = 0;
  std::uint64_t least_version = 0;
  std::function<void(const FetchProgress&)> progress;  ///< may be empty
  std::function<void(const FetchWait&)> waiting;       ///< may be empty
};

struct FetchReport {
  std::uint64_t epoch = 0;
  std::uint64_t version = 0;
  std::int64_t expires = 0;            ///< seconds since 1970, UTC; kNever
  std::vector<std::string> blocked;    ///< paths NAME.modar that belong to somebody else's file
  bool changed = false;                ///< false: this release was installed already
  std::vector<std::string> bundles;    ///< paths of the installed bundles
  std::uint64_t downloaded_bytes = 0;  ///< bodies of all responses
  std::uint64_t reused_bytes = 0;      ///< raw bytes taken from installed bundles
  std::uint32_t downloaded_pieces = 0;
  std::uint32_t reused_pieces = 0;
  std::uint32_t retries = 0;
  std::uint32_t corrupt_pieces = 0;  ///< discarded and downloaded again
};

/// Brings the store up to the server's newest release. Whatever happens and wherever it is killed,
/// the release in use stays whole; the next call resumes with what was downloaded. Errors:
/// kExitWrongKey, kExitRollBack, kExitExpired, kExitMixed, kExitNoSpace, kExitLocked, kExitNetwork,
/// kExitBadBundle; kIo; kUnsupported "fetch.device" (nothing for this device).
Result<FetchReport> fetch_release(const FetchOptions& options);

struct StoreReport {
  std::uint64_t version = 0;         ///< of the release in use
  std::vector<std::string> bundles;  ///< paths
  bool fell_back = false;  ///< the release in use was damaged: the one before it is in use now
};

/// Checks every installed bundle against its signed hash and the rules of a good bundle, and goes
/// back to the release before if one is damaged.
/// Errors: kExitLocked; kExitBadBundle "store.damaged" (no intact release is left); kIo.
Result<StoreReport> verify_store(const std::string& store);

/// The release in use and the paths of its bundles, read without the lock; nothing if there is
/// none.
std::optional<StoreReport> installed_release(const std::string& store);

}  // namespace modar
