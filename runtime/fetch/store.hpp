// The installer's folder on the device. Internal to runtime/fetch.
//
//   lock                  held while a fetch is running
//   state.json            trusted key, highest version installed; slots/state.json: a copy
//   pieces/               the download so far; <id>.part is incomplete
//   slots/a, slots/b      a release each: release.json, its signature, NAME.modar, NAME.recipe
//   current -> slots/a    the release in use, switched in one step; where the file system has no
//                         symbolic links, a file that says "slots/a"
//   NAME.modar -> current/NAME.modar (only where there are symbolic links)
//
// Everything else in there belongs to others and is never removed. Others may write into the
// folder: links, pipes and hard links that they plant lead nothing outside (folder.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "folder.hpp"
#include "formats/base/error.hpp"
#include "formats/base/folder_lock.hpp"
#include "modar/release.hpp"

namespace modar::fetch {

struct StoreState {
  std::uint64_t epoch = 0;    ///< of the root metadata that is believed; 0: none
  std::uint64_t version = 0;  ///< highest that was installed in that epoch
  std::string root_key;       ///< root_set_line() that was given with --trust
  std::string roots;          ///< where the chain of root keys has led to; empty: still root_key
  std::uint32_t root_serial = 0;  ///< of the chain's last link that was read
  std::string trusted_key;  ///< where the root metadata and the chain of keys have led to; empty:
                            ///< nowhere yet, as several root keys never sign releases
  std::uint32_t key_serial = 0;
  std::int64_t time = 0;  ///< latest that a believed document was signed at, seconds since 1970
  bool fresh = true;      ///< nothing is known: a new store, or both copies are lost
};

/// Endings of files: NAME.modar, in a slot, and NAME.first, the preview of a bundle, in
/// `pieces`, which counts as no bundle.
inline constexpr const char* kWhole = ".modar";
inline constexpr const char* kFirst = ".first";

/// Reads state.json; nothing if it is damaged.
std::optional<StoreState> parse_state(std::string_view json);

/// A release in a slot.
struct InstalledRelease {
  Folder folder;
  std::string text;  ///< of the release document
  Release release;
};

class Store {
 public:
  /// Creates missing parts and takes the lock, which is held until the object is destroyed.
  /// Errors: kIo, "store.link" where a folder of the store is a link; kExitLocked "store.locked".
  static Result<Store> open(const std::string& path);

  [[nodiscard]] const Folder& folder() const { return root_; }
  [[nodiscard]] const Folder& pieces() const { return pieces_; }
  /// The newer of its two copies.
  [[nodiscard]] StoreState state() const;
  /// Writes both copies.
  Result<void> save_state(const StoreState& state) const;

  /// The release in use, if its slot has a readable one.
  [[nodiscard]] std::optional<InstalledRelease> active() const;
  /// The release in the slot that is not in use.
  [[nodiscard]] std::optional<InstalledRelease> other() const;
  /// The folder in which the next release is built.
  [[nodiscard]] const Folder& spare_folder() const;

  /// Puts a complete slot in use and updates the links NAME.modar.
  Result<void> activate(const InstalledRelease& release) const;
  /// Makes the links NAME.modar those of the release. A file of that name that is not one of our
  /// links stays.
  Result<void> link_bundles(const Release& release) const;
  /// Bundles of the release whose link is missing because somebody else's file has its name.
  [[nodiscard]] std::vector<std::string> blocked_links(const Release& release) const;

  /// Removes pieces and parts of pieces, but for those of the ids in `keep`, and previews, but
  /// for those whose names are in it.
  Result<void> remove_pieces(const std::set<std::string>& keep) const;
  /// Removes a release from a slot, but for the bundles in `keep`.
  Result<void> clear_slot(const Folder& slot, const std::set<std::string>& keep) const;

 private:
  Store(Folder root, Folder slots, Folder a, Folder b, Folder pieces, FolderLock lock);
  Folder root_, slots_, a_, b_, pieces_;
  FolderLock lock_;
};

/// The slot in use, from `current`: "slots/a", "slots/b", or empty.
std::string active_slot(const Folder& store);
/// The release in use; nothing if none exists.
std::optional<InstalledRelease> active_release(const Folder& store);
/// Paths of those of the bundles of the release in use that are installed.
std::vector<std::string> installed_paths(const Folder& store, const InstalledRelease& release);
/// Paths of the previews of bundles of which `release` has none installed.
std::vector<std::string> first_paths(const Folder& store,
                                     const std::optional<InstalledRelease>& release);

/// Reads the release in a slot; nothing if it has none.
std::optional<InstalledRelease> read_slot(const Folder& folder);

}  // namespace modar::fetch
