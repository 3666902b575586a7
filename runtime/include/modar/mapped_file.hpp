// A file mapped for reading: nothing is copied, and pages are loaded when they are accessed.
// Another program may write to the file or shorten it, or its disk may be removed: see intact().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "formats/base/error.hpp"

namespace modar {

class BundleView;

class MappedFile {
 public:
  /// Errors: kIo "io.open", "io.map"; an empty file is kInvalidInput "io.empty".
  static Result<MappedFile> open(const std::string& path);
  /// `length` bytes of an open file from `offset` on, such as an asset inside an APK. The caller
  /// keeps the descriptor and may close it. If the offset is not a multiple of 8, as tables
  /// require, the bytes are copied instead of mapped. Errors: kIo "io.map", kUsage "io.range" if
  /// the file is shorter.
  static Result<MappedFile> open(int descriptor, std::uint64_t offset, std::uint64_t length);
  MappedFile() = default;
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

  /// Whether the bytes are still those that were opened. Costs one stat(). Errors: kIo "io.changed"
  /// if pages were lost (see guard_mapped_files()), or if the file at the path was written to. A
  /// file that was renamed over it changes nothing here.
  [[nodiscard]] Result<void> intact() const;
  /// The result of work on the bytes, or the error of intact().
  template <class T>
  [[nodiscard]] Result<T> settle(Result<T> result) const {
    const Result<void> same = intact();
    return same ? std::move(result) : tl::unexpected<Error>(same.error());
  }

  /// Copies the pages of the first `size` bytes in place: they stay unchanged whatever happens to
  /// the file. Not for forget_read(). Errors: kIo "io.map".
  Result<void> keep(std::size_t size);

 private:
  std::string path_;  ///< empty: opened from a descriptor
  /// Device, inode, size and time of the last change when it was opened.
  std::array<std::int64_t, 4> stamp_{};
  struct MappedRange* range_ = nullptr;  ///< entry of mapped_ for the guard
  std::span<const std::byte> bytes_;
  std::span<const std::byte> mapped_;  ///< whole pages around bytes_; empty where bytes_ are a copy
  std::unique_ptr<std::byte[]> copy_;
};

/// A view of the bundle in a file that others may change: its tables, which were validated, are
/// kept, so that changes can spoil drawing and tracking, but access no memory elsewhere.
/// Errors: those of BundleView::open(), keep() and intact().
Result<BundleView> open_bundle(MappedFile& file);

/// Installs a handler for SIGBUS, which the system sends when a page of a MappedFile cannot be
/// read: the file was shortened or its disk removed. The handler puts zeros there, and intact()
/// fails from then on. Faults elsewhere are passed to the handler that was installed before. For
/// programs that own their process; an app decides with modar_guard_files(). Later calls do
/// nothing.
void guard_mapped_files();

/// Advises the system that these bytes (part of a mapping, or any memory) will be read next, front
/// to back, so that it can read ahead. Never fails; without support it does nothing.
void expect_reading(std::span<const std::byte> bytes);

/// Returns the memory behind bytes of a MappedFile to the system: they were read and are not needed
/// soon. Reading them again is correct, only slower. Never fails.
void forget_read(std::span<const std::byte> bytes);

}  // namespace modar
