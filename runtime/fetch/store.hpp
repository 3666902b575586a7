// The installer's folder on the device, and what the installer does with files. Internal to
// runtime/fetch.
//
//   lock                  held while a fetch is running
//   state.json            trusted key, highest version installed; slots/state.json: a copy
//   pieces/               what was downloaded so far; <id>.part is incomplete
//   slots/a, slots/b      a release each: release.json, its signature, NAME.modar, NAME.recipe
//   current -> slots/a    the release in use, switched in one step; where the file system has no
//                         symbolic links, a file that says "slots/a"
//   NAME.modar -> current/NAME.modar (only where there are symbolic links)
//
// Everything else in there belongs to others and is never removed.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "formats/error.hpp"
#include "formats/folder_lock.hpp"
#include "modar/release.hpp"

namespace modar::fetch {

/// @name Files
/// Every error names the path.
/// @{
/// Creates a folder if it is missing. Errors: kIo "io.create".
Result<void> make_folder(const std::string& path);
/// Names in a folder without "." and "..", sorted; empty if there is no such folder.
std::vector<std::string> list_folder(const std::string& path);
/// Nothing if it cannot be read or is longer than `limit` bytes.
std::optional<std::string> read_small_file(const std::string& path, std::size_t limit);
/// Bytes; nothing if there is no such file.
std::optional<std::uint64_t> file_size(const std::string& path);
Result<void> remove_file(const std::string& path);
/// Errors: kIo "io.rename".
Result<void> rename_file(const std::string& from, const std::string& to);
/// Syncs the names in a folder to the disk. Errors: kIo "io.sync".
Result<void> sync_folder(const std::string& path);
/// Points the symbolic link `path` at `target` atomically; false where the file system has no
/// symbolic links. Errors: kIo "io.link".
Result<bool> switch_link(const std::string& path, const std::string& target);
/// Whether there is anything of that name, a dangling link included.
bool path_exists(const std::string& path);
/// Target of a symbolic link, or empty.
std::string link_target(const std::string& path);
/// Free bytes of the file system of `path`. Errors: kIo "io.space".
Result<std::uint64_t> free_space(const std::string& path);

/// A file open for writing at any offset; closed when destroyed.
class OutputFile {
 public:
  /// Creates the file, or opens it and keeps what it holds. Never follows a symbolic link.
  /// Errors: kIo "io.create".
  static Result<OutputFile> open(const std::string& path);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  ~OutputFile();
  /// Errors: kIo "io.write".
  Result<void> write_at(std::uint64_t offset, const void* bytes, std::size_t size);
  /// Cuts the file off, or makes it longer by zeros: then its last byte may be overwritten with 0.
  Result<void> resize(std::uint64_t size);
  Result<void> sync();

 private:
  OutputFile(int descriptor, std::string path);
  int descriptor_ = -1;
  std::string path_;
};
/// @}

struct StoreState {
  std::uint64_t epoch = 0;    ///< of the root's word that is believed; 0: none
  std::uint64_t version = 0;  ///< highest that was installed in that epoch
  std::string root_key;       ///< public_key_line() that was given with --trust
  std::string trusted_key;    ///< where the root's word and the chain of keys have led to
  std::uint32_t key_serial = 0;
  bool fresh = true;  ///< nothing is known: a new store, or both copies are lost
};

/// Reads state.json; nothing if it is damaged.
std::optional<StoreState> parse_state(std::string_view json);

/// A release in a slot.
struct InstalledRelease {
  std::string folder;
  std::string text;  ///< of the release document
  Release release;
};

class Store {
 public:
  /// Creates what is missing and takes the lock, which is held until the object is destroyed.
  /// Errors: kIo; kExitLocked "store.locked".
  static Result<Store> open(const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string pieces() const { return path_ + "/pieces"; }
  /// The newer of its two copies.
  [[nodiscard]] StoreState state() const;
  /// Writes both copies.
  Result<void> save_state(const StoreState& state) const;

  /// The release in use, if its slot has a readable one.
  [[nodiscard]] std::optional<InstalledRelease> active() const;
  /// The release in the slot that is not in use.
  [[nodiscard]] std::optional<InstalledRelease> other() const;
  /// The folder in which the next release is built.
  [[nodiscard]] std::string spare_folder() const;

  /// Puts a complete slot in use and updates the links NAME.modar.
  Result<void> activate(const InstalledRelease& release) const;
  /// Makes the links NAME.modar those of the release. A file of that name that is not a link of
  /// ours stays.
  Result<void> link_bundles(const Release& release) const;
  /// Bundles of the release whose link is missing because somebody else's file has its name.
  [[nodiscard]] std::vector<std::string> blocked_links(const Release& release) const;

  /// Removes pieces and parts of pieces, but for those of the ids in `keep`.
  Result<void> remove_pieces(const std::set<std::string>& keep) const;
  /// Removes a release from a slot, but for the bundles in `keep`.
  Result<void> clear_slot(const std::string& slot, const std::set<std::string>& keep) const;

 private:
  Store(std::string path, FolderLock lock);
  std::string path_;
  FolderLock lock_;
};

/// The folder of the slot in use, from `current`; empty if there is none.
std::string active_slot(const std::string& store);
/// Paths of those of a release's bundles that are installed in that slot.
std::vector<std::string> installed_paths(const std::string& store, const Release& release);

/// Reads the release in a slot; nothing if it has none.
std::optional<InstalledRelease> read_slot(const std::string& folder);

}  // namespace modar::fetch
