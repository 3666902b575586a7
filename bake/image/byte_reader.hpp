// Numbers out of bytes at checked offsets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace modar {

/// Reads integers of a file's bytes; what lies beyond the end reads as 0, so callers check has().
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes, bool big_endian = false)
      : bytes_(bytes), big_endian_(big_endian) {}

  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] bool has(std::size_t offset, std::size_t count) const {
    return offset <= bytes_.size() && count <= bytes_.size() - offset;
  }
  [[nodiscard]] std::uint32_t u8(std::size_t offset) const { return number(offset, 1); }
  [[nodiscard]] std::uint32_t u16(std::size_t offset) const { return number(offset, 2); }
  [[nodiscard]] std::uint32_t u24(std::size_t offset) const { return number(offset, 3); }
  [[nodiscard]] std::uint32_t u32(std::size_t offset) const { return number(offset, 4); }
  [[nodiscard]] bool starts_with(std::string_view text, std::size_t offset = 0) const {
    if (!has(offset, text.size())) return false;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (bytes_[offset + i] != static_cast<std::byte>(text[i])) return false;
    }
    return true;
  }
  [[nodiscard]] std::span<const std::byte> part(std::size_t offset, std::size_t count) const {
    return has(offset, count) ? bytes_.subspan(offset, count) : std::span<const std::byte>();
  }

 private:
  [[nodiscard]] std::uint32_t number(std::size_t offset, std::size_t count) const {
    if (!has(offset, count)) return 0;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t at = offset + (big_endian_ ? i : count - 1 - i);
      value = value << 8 | std::to_integer<std::uint32_t>(bytes_[at]);
    }
    return value;
  }

  std::span<const std::byte> bytes_;
  bool big_endian_;
};

}  // namespace modar
