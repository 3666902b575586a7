// Installs releases on the device. `modar-fetch` is a command line for it; an app may call it on a
// separate thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "modar/release.hpp"

namespace modar {

struct FetchProgress {
  std::uint64_t bytes_done = 0;  ///< of the bytes to download
  std::uint64_t bytes_total = 0;
  double seconds_left = -1;  ///< -1: not known yet
};

/// A file whose download failed and will be tried again.
struct FetchWait {
  std::string address;
  std::string cause;
  unsigned attempt = 0;   ///< number of the next attempt, of those in a row without data
  unsigned attempts = 0;  ///< number of attempts after which it gives up
  double seconds = 0;     ///< until the next attempt
};

/// A file that a fetch is about to request.
struct FileNeed {
  std::string path;         ///< below the release folder
  std::uint64_t from = 0;   ///< first byte to send
  std::uint64_t limit = 0;  ///< largest possible size of the file
};

/// For an app with its own network stack, called from the thread that calls fetch_release(), for
/// one file at a time: passes the bytes of the file `path` in the release folder, from byte `from`
/// to its end, to `take` in portions, until that returns false. Errors: kExitMixed "fetch.missing"
/// (no such file); "fetch.later": the app downloads the files that FetchOptions::needs announced
/// and calls fetch_release() again, so this call ends with that error; any other: the fetch tries
/// again.
using ByteSource =
    std::function<Result<void>(const std::string& path, std::uint64_t from,
                               const std::function<bool(std::span<const std::byte>)>& take)>;

struct FetchOptions {
  std::string url;    ///< http://, https://, file:// or a folder that `modar ship publish` filled
  std::string store;  ///< folder of the installed bundles; created if missing
  std::string trusted_key;             ///< text of K.pub, or of a file of `modar ship trust`
  std::string device;                  ///< only bundles for this profile; empty: any
  std::vector<std::string> bundles;    ///< only these; empty: all
  unsigned parallel = 4;               ///< simultaneous downloads
  std::uint64_t bytes_per_second = 0;  ///< cap, not for a ByteSource; 0: none
  unsigned attempts = 8;               ///< attempts in a row without any data before it gives up
  double first_wait_s = 0.5;           ///< before the second attempt, doubled each time
  double stall_s = 30;                 ///< a silent connection is closed after this
  std::string
      authorities;  ///< PEM file for HTTPS; empty: CURL_CA_BUNDLE, SSL_CERT_FILE, the system's
  /// Seconds since 1970, for callers whose clock does not end in 2038 as std::time() may (32-bit
  /// devices, WebAssembly); 0: std::time().
  std::int64_t now = 0;
  ByteSource source;  ///< instead of the URL; a library built without libcurl needs it
  /// Called before the source, with the files that are needed, in order. May be empty.
  std::function<void(std::span<const FileNeed>)> needs;
  /// Releases older than this one are refused (exit code 11), as if it had been installed: the one
  /// that the app was shipped with. 0: none.
  std::uint64_t least_epoch = 0;
  std::uint64_t least_version = 0;
  /// Called for each bundle of which no release in use has one, as soon as it can be shown and
  /// before the rest of the release comes, with the path of its preview: a bundle NAME.first,
  /// coarse but good, that is there until the fetch has ended well. May be empty: none are made.
  std::function<void(const std::string& path)> first;
  std::function<void(const FetchProgress&)> progress;  ///< may be empty
  std::function<void(const FetchWait&)> waiting;       ///< may be empty
};

struct FetchReport {
  std::uint64_t epoch = 0;
  std::uint64_t version = 0;
  std::int64_t expires = 0;            ///< seconds since 1970, UTC; kNever
  std::vector<std::string> blocked;    ///< paths NAME.modar that hold files of another program
  bool changed = false;                ///< false: this release was installed already
  std::vector<std::string> bundles;    ///< paths of the installed bundles
  std::uint64_t downloaded_bytes = 0;  ///< bodies of all responses
  std::uint64_t reused_bytes = 0;      ///< raw bytes taken from installed bundles
  std::uint32_t downloaded_pieces = 0;
  std::uint32_t reused_pieces = 0;
  std::uint32_t retries = 0;
  std::uint32_t corrupt_pieces = 0;  ///< discarded and downloaded again
};

/// Updates the store to the server's newest release. If it fails or is killed, the release in use
/// stays intact, and the next call resumes the download. Errors:
/// kExitWrongKey, kExitRollBack, kExitExpired, kExitMixed, kExitNoSpace, kExitLocked, kExitNetwork,
/// kExitBadBundle; kIo; kUnsupported "fetch.device" (nothing for this device).
Result<FetchReport> fetch_release(const FetchOptions& options);

struct StoreReport {
  std::uint64_t version = 0;         ///< of the release in use
  std::vector<std::string> bundles;  ///< paths
  bool fell_back = false;  ///< the release in use was damaged: the previous one is now in use
};

/// Checks every installed bundle against its signed hash and the rules of valid bundles, and falls
/// back to the previous release if one is damaged.
/// Errors: kExitLocked; kExitBadBundle "store.damaged" (no intact release is left); kIo.
Result<StoreReport> verify_store(const std::string& store);

/// The release in use and the paths of its bundles, read without the lock; nothing if none exists.
std::optional<StoreReport> installed_release(const std::string& store);

/// Paths of the previews that a fetch that was interrupted has left, of bundles that are not
/// installed; read without the lock.
std::vector<std::string> previews(const std::string& store);

}  // namespace modar
