// A file mapped for reading: nothing is copied, and pages are loaded when they are accessed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "formats/base/error.hpp"

namespace modar {

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

 private:
  std::span<const std::byte> bytes_;
  std::span<const std::byte> mapped_;  ///< whole pages around bytes_; empty where bytes_ are a copy
  std::unique_ptr<std::byte[]> copy_;
};

/// Advises the system that these bytes (part of a mapping, or any memory) will be read next, front
/// to back, so that it can read ahead. Never fails; without support it does nothing.
void expect_reading(std::span<const std::byte> bytes);

/// Returns the memory behind bytes of a MappedFile to the system: they were read and are not needed
/// soon. Reading them again is correct, only slower. Never fails.
void forget_read(std::span<const std::byte> bytes);

}  // namespace modar
