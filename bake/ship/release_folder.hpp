// The folder that a publisher writes and any web server or USB stick can serve:
//
//   latest                       number of the newest release
//   releases/N.json(.minisig)    release documents
//   releases/N.fresh.json(.minisig)  that release N is still the newest, signed every few days
//   keys/S.json(.minisig)        the chain of keys
//   root.json(.minisig)          the root key's word: which key signs; of several root keys,
//                                root.json.KEY.minisig each
//   roots/S.json, S.json.KEY.minisig  the chain of root keys
//   objects/ab/abcdef...         pieces and recipes, by the BLAKE2b of their bytes
//   .objects, .lock              the publisher's own: earlier reads; who is at work
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bake/ship/keys/keys.hpp"
#include "bake/ship/object_ledger.hpp"
#include "bake/ship/recipe_maker.hpp"
#include "formats/base/folder_lock.hpp"
#include "modar/release.hpp"

namespace modar {

/// Holds the lock of the folder: one publisher at a time.
class ReleaseFolder {
 public:
  /// Creates missing parts. Errors: kIo; kExitLocked "ship.locked"; kUsage "out.foreign-folder" for
  /// one of other files, unless `force` is set.
  static Result<ReleaseFolder> open(const std::string& path, bool force = false);

  /// Numbers of the releases, by epoch, then ascending.
  [[nodiscard]] std::vector<std::uint64_t> versions() const;
  /// The one that `latest` names; nothing in a new folder. Errors: kInvalidInput "release.*"; kIo.
  [[nodiscard]] Result<std::optional<Release>> newest() const;
  /// When a release was published: the time of its document's file, seconds since 1970.
  [[nodiscard]] std::int64_t published(std::uint64_t version) const;
  [[nodiscard]] Result<Release> release(std::uint64_t version) const;
  /// Number of links in the chain of keys.
  [[nodiscard]] std::uint32_t key_rotations() const;
  /// The root metadata; epoch 0: none.
  [[nodiscard]] Result<RootMetadata> root_metadata() const;
  /// Refuses a key that is not the one devices have been led to: by the chain, by the root
  /// metadata, by the newest release. Errors: kUsage "ship.key".
  [[nodiscard]] Result<void> check_signer(const PublicKey& key) const;

  /// Writes the objects that are missing or hold other bytes; returns the bytes written.
  Result<std::uint64_t> add_objects(const PublishedBundle& bundle, ObjectLedger& ledger) const;
  /// Refuses a bundle of which an object is missing or holds other bytes. Errors: kIo
  /// "ship.damaged".
  Result<void> check_objects(const ReleaseBundle& bundle, ObjectLedger& ledger) const;
  /// Writes and signs the document and its freshness, then points `latest` at it.
  Result<void> add_release(const Release& release, std::int64_t now, const SecretKey& key) const;
  /// Signs that the release is the newest at this time (seconds since 1970), and for the days that
  /// its document says. Writes nothing where that says none.
  Result<void> add_freshness(const Release& release, std::int64_t now, const SecretKey& key) const;
  /// Writes the root metadata: `next` signs from now on, and a new epoch begins.
  /// Errors: kUsage "ship.root" (another key than that of the word before, or several keys have to
  /// agree).
  Result<RootMetadata> add_root_metadata(const PublicKey& next, const SecretKey& root) const;
  /// Number of links in the chain of root keys.
  [[nodiscard]] std::uint32_t root_rotations() const;
  /// The root keys that the chain leads to from those that devices were given.
  /// Errors: kExitWrongKey "signature.too-few"; kInvalidInput "release.*".
  [[nodiscard]] Result<RootSet> roots(const RootSet& trust) const;
  /// Writes a document of root keys: `path` in the folder, and a signature by each of these keys.
  Result<void> add_signed(const std::string& path, const std::string& text,
                          const std::vector<std::pair<PublicKey, std::string>>& signatures) const;
  /// Appends `next` to the chain, signed by `key`.
  Result<void> add_key(const PublicKey& next, const SecretKey& key) const;
  /// Removes all but the `keep` newest releases, then the objects that no release needs; returns
  /// their bytes.
  Result<std::uint64_t> prune(std::uint64_t keep) const;

 private:
  ReleaseFolder(std::string path, FolderLock lock);
  /// A bundle's recipe as RecipeView reads it. Errors: kIo "ship.recipe"; kInvalidInput.
  [[nodiscard]] Result<std::vector<std::byte>> recipe(const ReleaseBundle& bundle) const;
  std::string path_;
  FolderLock lock_;
};

}  // namespace modar
