// Every output is written next to its place, synced and renamed: a reader sees the old file or the
// new one, never half of one.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "formats/base/error.hpp"
#include "formats/base/leftover.hpp"

namespace modar {

/// A file under construction. Destroyed before commit(), it leaves nothing behind.
class AtomicFile {
 public:
  /// Creates "<path>.<pid>.tmp" in the folder of `path`, with the mode and, where that is allowed,
  /// the owner of the file that it will replace. A symbolic link is followed to its target; special
  /// files (/dev/null, a pipe) are opened and written directly. Errors: kIo "io.create".
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// Errors: kIo "io.write".
  Result<void> write(std::span<const std::byte> bytes);
  /// Syncs the file, renames it over `path`, syncs the folder. Errors: kIo "io.commit";
  /// kIo "io.changed" while a mapped input has lost pages (lost_pages.hpp).
  Result<void> commit();

 private:
  AtomicFile(int descriptor, std::string path, std::string temporary, Leftover leftover);
  int descriptor_ = -1;
  std::string path_;
  std::string temporary_;
  Leftover leftover_;
};

/// Syncs a folder, so that new and renamed files in it survive a power cut. False: see
/// errno.
bool sync_folder(const std::string& path);

/// What a person can do where a file cannot be written, by errno.
const char* cure_of_writing(int number);

/// Writes a whole file through AtomicFile.
Result<void> write_file(const std::string& path, std::string_view text);
Result<void> write_file(const std::string& path, std::span<const std::byte> bytes);

}  // namespace modar
