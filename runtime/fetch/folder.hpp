// A folder held open: changes stay in it, whatever links others plant. Internal to
// runtime/fetch.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/error.hpp"
#include "modar/mapped_file.hpp"

namespace modar::fetch {

/// A file open for writing at any offset; closed when destroyed.
class OutputFile {
 public:
  OutputFile(int descriptor, std::string path);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  ~OutputFile();
  /// Errors: kIo "io.write".
  Result<void> write_at(std::uint64_t offset, const void* bytes, std::size_t size);
  /// Cuts the file off, or makes it longer by zeros: then its last byte may be overwritten with 0.
  Result<void> resize(std::uint64_t size);
  Result<void> sync();

 private:
  int descriptor_ = -1;
  std::string path_;
};

/// Names are those of files right in the folder. Reads regular files only, and follows no link;
/// copies share the descriptor. Every error names the path.
class Folder {
 public:
  /// The folder that somebody named, through links too. make: create it where it is missing.
  /// Errors: kIo "io.create".
  static Result<Folder> open(const std::string& path, bool make);
  /// A folder in this one. Errors: kIo "io.create"; kIo "store.link" where it is a link.
  [[nodiscard]] Result<Folder> below(const std::string& name, bool make) const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string path_of(const std::string& name) const { return path_ + "/" + name; }

  /// Names without "." and "..", sorted.
  [[nodiscard]] std::vector<std::string> list() const;
  /// Whether there is anything of that name, a dangling link included.
  [[nodiscard]] bool has(const std::string& name) const;
  /// Bytes; nothing if there is no such file.
  [[nodiscard]] std::optional<std::uint64_t> size(const std::string& name) const;
  /// Whether the file has other names as well, under which it may be written to.
  [[nodiscard]] bool has_other_names(const std::string& name) const;
  /// Nothing if it cannot be read or is longer than `limit` bytes.
  [[nodiscard]] std::optional<std::string> read(const std::string& name, std::size_t limit) const;
  /// Errors: kIo "io.open"; kInvalidInput "io.empty".
  [[nodiscard]] Result<MappedFile> map(const std::string& name) const;

  /// Writes a file anew: whatever had the name keeps its bytes and loses the name. Errors: kIo
  /// "io.create" (a folder has the name).
  [[nodiscard]] Result<OutputFile> create(const std::string& name) const;
  /// Continues a file that has no other name; else as create().
  [[nodiscard]] Result<OutputFile> resume(const std::string& name) const;
  /// The whole file in one step, synced. Errors: kIo.
  [[nodiscard]] Result<void> replace(const std::string& name, std::string_view text) const;
  [[nodiscard]] Result<void> remove(const std::string& name) const;
  /// Errors: kIo "io.rename".
  [[nodiscard]] Result<void> rename(const std::string& from, const std::string& to) const;
  /// Syncs the names to the disk. Errors: kIo "io.sync".
  [[nodiscard]] Result<void> sync() const;

  /// Target of a symbolic link, or empty.
  [[nodiscard]] std::string link_target(const std::string& name) const;
  /// Points the symbolic link at `target` in one step; false where the file system has no symbolic
  /// links. Errors: kIo "io.link".
  [[nodiscard]] Result<bool> switch_link(const std::string& name, const std::string& target) const;
  /// Free bytes of the file system. Errors: kIo "io.space".
  [[nodiscard]] Result<std::uint64_t> free_space() const;

 private:
  struct Descriptor;
  Folder(std::shared_ptr<const Descriptor> descriptor, std::string path);
  [[nodiscard]] int number() const;
  std::shared_ptr<const Descriptor> descriptor_;
  std::string path_;
};

/// A file that somebody named. Nothing if it cannot be read or is longer than `limit` bytes.
std::optional<std::string> read_small_file(const std::string& path, std::size_t limit);

}  // namespace modar::fetch
