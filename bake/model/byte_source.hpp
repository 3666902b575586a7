// Bytes by offset, from a file or from memory.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace modar {

/// A file is read rather than mapped: one that shrinks meanwhile gives fewer bytes, where a map
/// would end the program, and the pages read count for nobody's memory. Safe for several threads.
class ByteSource {
 public:
  explicit ByteSource(std::string_view text) : text_(text), size_(text.size()) {}
  /// descriptor: of an open regular file; stays the caller's.
  ByteSource(int descriptor, std::uint64_t size) : descriptor_(descriptor), size_(size) {}

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Copies up to `count` bytes from `offset` to `out`. Returns how many, -1 where reading failed.
  std::int64_t read(std::uint64_t offset, std::size_t count, char* out) const;

 private:
  std::string_view text_;
  int descriptor_ = -1;
  std::uint64_t size_;
};

}  // namespace modar
