// Proves a release folder, or a mirror of one, whole: every signed document and object.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "modar/release.hpp"

namespace modar {

/// A file below a release folder, which must not be longer than `limit` bytes; nothing if none.
using ReleaseReader =
    std::function<Result<std::optional<std::string>>(const std::string& path, std::size_t limit)>;

/// The files of a folder; regular ones only. Errors of the reader: kIo "io.read".
ReleaseReader read_release_folder(const std::string& folder);

/// The root keys that the chain of root keys leads to from those that devices were given.
/// Errors: those of the reader; kExitWrongKey "signature.too-few"; kExitMixed "ship.chain";
/// kInvalidInput "release.*".
Result<RootSet> follow_root_chain(const ReleaseReader& read, const RootSet& trusted);

/// The newest release, verified as by a device without a state; none of its objects is read.
/// Errors: those of verify_release(); kExitMixed "ship.absent" where there is no release.
Result<Release> newest_release(const ReleaseReader& read, const RootSet& trusted);

struct DamagedObject {
  std::string path;    ///< below the release folder
  std::string bundle;  ///< the first that needs it
  std::string cause;
};

struct VerifyReport {
  Release release;  ///< the newest
  PublicKey key;    ///< signed it: where the root metadata and the chain lead from the given one
  std::uint64_t objects = 0;
  std::uint64_t bytes = 0;  ///< of the objects that are whole
  std::vector<DamagedObject> damaged;
};

/// Reads what a device without a state would read, and every object of the newest release.
/// `progress` receives the finished part, 0 to 1.
/// Errors: those of the reader; kExitWrongKey; kExitMixed; kInvalidInput "release.*".
Result<VerifyReport> verify_release(const ReleaseReader& read, const RootSet& trusted,
                                    const std::function<void(double)>& progress);

}  // namespace modar
