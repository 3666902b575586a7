// The installer's folder on the device, and what the installer does with files. Internal to
// runtime/fetch.
//
//   lock                  held while a fetch is running
//   state.json            trusted key, highest version installed
//   pieces/               what was downloaded so far; <id>.part is incomplete
//   slots/a, slots/b      a release each: release.json, its signature, NAME.modar, NAME.recipe
//   current -> slots/a    the release in use, switched in one step
//   NAME.modar -> current/NAME.modar
#pragma once

#include <cstdint>
#include <optional>
#include <string>
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
/// Removes the files in a folder, not the folder. Errors: kIo "io.remove".
Result<void> empty_folder(const std::string& path);
/// Nothing if it cannot be read or is longer than `limit` bytes.
std::optional<std::string> read_small_file(const std::string& path, std::size_t limit);
/// Bytes; nothing if there is no such file.
std::optional<std::uint64_t> file_size(const std::string& path);
Result<void> remove_file(const std::string& path);
/// Errors: kIo "io.rename".
Result<void> rename_file(const std::string& from, const std::string& to);
/// Syncs the names in a folder to the disk. Errors: kIo "io.sync".
Result<void> sync_folder(const std::string& path);
/// Points the symbolic link `path` at `target` atomically. Errors: kIo "io.link".
Result<void> switch_link(const std::string& path, const std::string& target);
/// Gives a file a second name (a hard link); false where the file system cannot.
bool share_file(const std::string& path, const std::string& second);
/// Target of a symbolic link, or empty.
std::string link_target(const std::string& path);
/// Free bytes of the file system of `path`. Errors: kIo "io.space".
Result<std::uint64_t> free_space(const std::string& path);

/// A file open for writing at any offset; closed when destroyed.
class OutputFile {
 public:
  /// Creates the file, or opens it and keeps what it holds. Errors: kIo "io.create".
  static Result<OutputFile> open(const std::string& path);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  ~OutputFile();
  /// Errors: kIo "io.write".
  Result<void> write_at(std::uint64_t offset, const void* bytes, std::size_t size);
  Result<void> resize(std::uint64_t size);
  Result<void> sync();

 private:
  OutputFile(int descriptor, std::string path);
  int descriptor_ = -1;
  std::string path_;
};
/// @}

struct StoreState {
  std::uint64_t version = 0;  ///< highest that was installed
  std::string root_key;       ///< public_key_line() that was given with --trust
  std::string trusted_key;    ///< where the chain of keys has led to
  std::uint32_t key_serial = 0;
};

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
  [[nodiscard]] StoreState state() const;
  Result<void> save_state(const StoreState& state) const;

  /// The release in use, if its slot has a readable one.
  [[nodiscard]] std::optional<InstalledRelease> active() const;
  /// The release in the slot that is not in use.
  [[nodiscard]] std::optional<InstalledRelease> other() const;
  /// The folder in which the next release is built.
  [[nodiscard]] std::string spare_folder() const;

  /// Puts a complete slot in use and updates the links NAME.modar.
  Result<void> activate(const InstalledRelease& release) const;
  /// Makes the links NAME.modar those of the release.
  Result<void> link_bundles(const Release& release) const;
  /// Those of a release's bundles that are installed and in use.
  [[nodiscard]] std::vector<std::string> bundle_paths(const Release& release) const;

 private:
  Store(std::string path, FolderLock lock);
  std::string path_;
  FolderLock lock_;
};

/// Reads the release in a slot; nothing if it has none.
std::optional<InstalledRelease> read_slot(const std::string& folder);

}  // namespace modar::fetch
