// The cache of baked assets: each a bundle of one model or one pattern, by what went into it.
// Several processes and machines may share its folder: an entry appears whole, by a rename, and
// never changes. Each says of which key and which asset's file it is and what its bundle hashes to,
// so that no entry passes for another; with a key of the cache's it is signed as well, so that who
// can write into the folder cannot plant one. Whoever finds one damaged removes it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bake/report.hpp"
#include "bake/ship/keys/keys.hpp"
#include "formats/bundle_view.hpp"
#include "formats/bundle_writer.hpp"
#include "modar/mapped_file.hpp"

namespace modar {

/// Results of an asset's bake other than its bundle.
struct PartNotes {
  std::array<double, 3> model_sides{};
  std::vector<Diagnostic> diagnostics;
};

/// An entry that was read and whose hashes hold.
struct CachedPart {
  MappedFile file;
  BundleView bundle;  ///< of the file
  PartNotes notes;
};

class PartCache {
 public:
  /// The folder is made when something is written to it. With `signer`, what it has not signed is
  /// not believed. Errors of what writes: kIo "cache.folder" and those of AtomicFile.
  explicit PartCache(const std::string& folder, std::optional<SecretKey> signer = std::nullopt);

  /// The other files that the asset behind `action` named when it was baked last, relative to its
  /// own folder. Nothing: it was never baked.
  [[nodiscard]] std::optional<std::vector<std::string>> files_of(const std::string& action) const;
  [[nodiscard]] bool has(const std::string& key) const;
  /// The entry of the key and of the asset's file `name`. Nothing if there is no trustworthy one:
  /// `reason` then states the fault of the existing one, and is else empty.
  [[nodiscard]] std::optional<CachedPart> read(const std::string& key, const std::string& name,
                                               std::string& reason) const;
  Result<void> write_files(const std::string& action, const std::vector<std::string>& files) const;
  Result<void> write(const std::string& key, const std::string& name, const BundleContent& content,
                     const PartNotes& notes) const;

 private:
  [[nodiscard]] std::string path(const char* kind, const std::string& key,
                                 const char* extension) const;
  /// The place of a file, whose folder is made.
  [[nodiscard]] Result<std::string> place(const char* kind, const std::string& key,
                                          const char* extension) const;

  std::string folder_;
  std::string tag_;  ///< tells backup programs to leave the folder out
  std::optional<SecretKey> signer_;
};

/// The key of a shared cache: a secret key of `modar ship keygen` without a pass phrase. An empty
/// path: none. Errors: kIo "io.open"; kInvalidInput "key.secret", "key.pass-phrase".
Result<std::optional<SecretKey>> read_cache_key(const std::string& path);

}  // namespace modar
