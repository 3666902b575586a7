// Every output is written beside its place, synced and renamed: a reader sees the old file or the
// new one, never half of one.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "formats/base/error.hpp"

namespace modar {

/// A file under construction. Destroyed before commit(), it leaves nothing behind.
class AtomicFile {
 public:
  /// Creates "<path>.<pid>.tmp" in the folder of `path`, with the mode and, where that is allowed,
  /// the owner of the file that it will replace. A symbolic link is followed to its target; what is
  /// no regular file (/dev/null, a pipe) is opened and written to as it is.
  /// Errors: kIo "io.create".
  static Result<AtomicFile> create(const std::string& path);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// Errors: kIo "io.write".
  Result<void> write(std::span<const std::byte> bytes);
  /// Syncs the file, renames it over `path`, syncs the folder. Errors: kIo "io.commit".
  Result<void> commit();

 private:
  AtomicFile(int descriptor, std::string path, std::string temporary);
  int descriptor_ = -1;
  std::string path_;
  std::string temporary_;
};

/// Writes a whole file through AtomicFile.
Result<void> write_file(const std::string& path, std::string_view text);
Result<void> write_file(const std::string& path, std::span<const std::byte> bytes);

}  // namespace modar
