// What the installer does with files and folders, each call an Error that names the path.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/error.hpp"

namespace modar::fetch {

/// Creates a folder; one that is there already is fine. Errors: kIo "io.create".
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
/// Writes names of a folder through to the disk. Errors: kIo "io.sync".
Result<void> sync_folder(const std::string& path);
/// Points the symbolic link `path` at `target`, in one step. Errors: kIo "io.link".
Result<void> switch_link(const std::string& path, const std::string& target);
/// Gives a file a second name (a hard link); false where the file system cannot.
bool share_file(const std::string& path, const std::string& second);
/// What a symbolic link points at, or empty.
std::string link_target(const std::string& path);
/// Free bytes of the file system of `path`. Errors: kIo "io.space".
Result<std::uint64_t> free_space(const std::string& path);

/// A file open for writing at any place; closed when destroyed.
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

}  // namespace modar::fetch
