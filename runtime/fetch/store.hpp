// The installer's folder on the device:
//
//   lock                  held while a fetch is at work
//   state.json            trusted key, greatest version seen
//   pieces/               what came so far; <id>.part is on its way
//   slots/a, slots/b      a release each: release.json, its signature, NAME.modar, NAME.recipe
//   current -> slots/a    the one that is used, switched in one step
//   NAME.modar -> current/NAME.modar
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/error.hpp"
#include "formats/folder_lock.hpp"
#include "modar/release.hpp"
#include "modar/signature.hpp"

namespace modar::fetch {

struct StoreState {
  std::uint64_t version = 0;  ///< greatest that was installed
  std::string root_key;       ///< public_key_line() that was given with --trust
  std::string trusted_key;    ///< what the chain of keys has led to
  std::uint32_t key_serial = 0;
};

/// A release as it lies in a slot.
struct InstalledRelease {
  std::string folder;
  std::string text;  ///< of the release document
  Release release;
};

class Store {
 public:
  /// Creates what is missing and takes the lock, which is held until the object goes.
  /// Errors: kIo; kExitLocked "store.locked".
  static Result<Store> open(const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string pieces() const { return path_ + "/pieces"; }
  [[nodiscard]] StoreState state() const;
  Result<void> save_state(const StoreState& state) const;

  /// The release in use, if its slot holds one that reads.
  [[nodiscard]] std::optional<InstalledRelease> active() const;
  /// The release in the slot that is not in use.
  [[nodiscard]] std::optional<InstalledRelease> other() const;
  /// The folder that the next release is built in: not the one in use.
  [[nodiscard]] std::string spare_folder() const;

  /// Makes a finished slot the one in use, and the links at the top those of its bundles.
  Result<void> activate(const InstalledRelease& release) const;
  /// Puts the links NAME.modar right.
  Result<void> link_bundles(const Release& release) const;
  /// Those of a release's bundles that are installed and in use.
  [[nodiscard]] std::vector<std::string> bundle_paths(const Release& release) const;

 private:
  Store(std::string path, FolderLock lock);
  std::string path_;
  FolderLock lock_;
};

/// Reads the release in a slot, whether it is in use or not.
std::optional<InstalledRelease> read_slot(const std::string& folder);

}  // namespace modar::fetch
