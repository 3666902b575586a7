// UTF-8 as bundles hold it: well formed, without control characters, so that a name can be printed
// on any terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace modar {

/// Bytes of the character that starts at text[0] (1-4), or 0 if invalid: ill-formed
/// (Unicode 15, table 3-7) or a control character (U+0000-001F, U+007F-009F).
inline std::size_t utf8_character(std::string_view text) {
  const auto at = [&text](std::size_t i) {
    return i < text.size() ? static_cast<unsigned>(static_cast<unsigned char>(text[i])) : 0u;
  };
  const auto tail = [&at](std::size_t i) { return (at(i) & 0xC0u) == 0x80u; };
  const unsigned first = at(0);
  if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
  if (first < 0xC2 || first > 0xF4 || !tail(1)) return 0;
  if (first < 0xE0) return first == 0xC2 && at(1) < 0xA0 ? 0 : 2;
  // The second byte excludes overlong forms, surrogates and values beyond U+10FFFF.
  if ((first == 0xE0 && at(1) < 0xA0) || (first == 0xED && at(1) > 0x9F) ||
      (first == 0xF0 && at(1) < 0x90) || (first == 0xF4 && at(1) > 0x8F) || !tail(2)) {
    return 0;
  }
  if (first < 0xF0) return 3;
  return tail(3) ? 4 : 0;
}

/// All of it is such characters.
inline bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = utf8_character(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

/// The text with its control characters as "\x1B": none of it commands the terminal that it is
/// printed to, and none of it begins a line of its own.
inline std::string printable(std::string_view text) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  std::string out;
  while (!text.empty()) {
    const std::size_t size = utf8_character(text);
    const auto byte = static_cast<unsigned char>(text[0]);
    if (size == 0 && (byte < 0x20 || (byte >= 0x7F && byte < 0xA0))) {
      out += {'\\', 'x', kDigits[byte / 16], kDigits[byte % 16]};
    } else {
      out += text.substr(0, size == 0 ? 1 : size);
    }
    text.remove_prefix(size == 0 ? 1 : size);
  }
  return out;
}

/// True for a byte that no character starts with.
inline bool utf8_continues(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0u) == 0x80u;
}

/// Appends a character. code_point: up to U+10FFFF and no surrogate.
inline void append_utf8(std::string& text, std::uint32_t code_point) {
  const auto tail = [&](int shift) {
    return static_cast<char>(0x80u | (code_point >> shift & 0x3Fu));
  };
  if (code_point < 0x80) {
    text += static_cast<char>(code_point);
  } else if (code_point < 0x800) {
    text += {static_cast<char>(0xC0u | code_point >> 6), tail(0)};
  } else if (code_point < 0x10000) {
    text += {static_cast<char>(0xE0u | code_point >> 12), tail(6), tail(0)};
  } else {
    text += {static_cast<char>(0xF0u | code_point >> 18), tail(12), tail(6), tail(0)};
  }
}

/// A to Z as small letters, whatever the locale; all other bytes stay.
inline std::string ascii_lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

}  // namespace modar
