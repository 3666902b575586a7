// A file mapped for reading: nothing is copied, pages come when they are touched.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "formats/error.hpp"

namespace modar {

class MappedFile {
 public:
  /// Errors: kIo "io.open", "io.map"; an empty file is kInvalidInput "io.empty".
  static Result<MappedFile> open(const std::string& path);
  MappedFile() = default;
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile();

  [[nodiscard]] std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
};

/// Tells the system that these bytes (a part of a mapping, or any memory) are read next, front to
/// back, so that it may fetch them ahead. Never fails: where it cannot help, it does nothing.
void expect_reading(std::span<const std::byte> bytes);

/// Gives the memory behind bytes of a MappedFile back to the system: they were read and are not
/// needed soon. Reading them again is right, only slower. Never fails.
void forget_read(std::span<const std::byte> bytes);

}  // namespace modar
