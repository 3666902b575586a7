// A file mapped for reading: nothing is copied, pages come when they are touched.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "formats/error.hpp"

namespace modar {

class MappedFile {
 public:
  /// Errors: kIo "io.open", "io.map"; an empty file is kInvalidInput "io.empty".
  static Result<MappedFile> open(const std::string& path);
  /// `length` bytes of an open file from `offset` on, an asset inside an APK say. The descriptor
  /// stays the caller's and may be closed. Where the offset is not a multiple of 8, as tables need
  /// it, the bytes are copied instead of mapped. Errors: kIo "io.map", kUsage "io.range" where the
  /// file does not hold them.
  static Result<MappedFile> open(int descriptor, std::uint64_t offset, std::uint64_t length);
  MappedFile() = default;
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
  std::span<const std::byte> mapped_;  ///< whole pages around bytes_; empty where bytes_ are a copy
  std::unique_ptr<std::byte[]> copy_;
};

/// Tells the system that these bytes (a part of a mapping, or any memory) are read next, front to
/// back, so that it may fetch them ahead. Never fails: where it cannot help, it does nothing.
void expect_reading(std::span<const std::byte> bytes);

/// Gives the memory behind bytes of a MappedFile back to the system: they were read and are not
/// needed soon. Reading them again is right, only slower. Never fails.
void forget_read(std::span<const std::byte> bytes);

}  // namespace modar
