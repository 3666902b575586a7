// The places of the parts of a TOML text. toml++ checks what it says; this finds the bytes to
// change.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace modar {

/// Bytes [begin, end) of a text.
struct TextSpan {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// "a.b = value" of a table or between braces.
struct TomlPair {
  std::vector<std::string> key;
  TextSpan whole;  ///< from the key to the end of the value
  TextSpan value;
};

/// A header with the pairs below it. The first section of a text has no header.
struct TomlSection {
  std::vector<std::string> name;
  bool listed = false;  ///< [[name]]
  TextSpan header;      ///< empty of the first
  std::vector<TomlPair> pairs;
};

/// Sections in the order of the text, which toml++ has found valid; of others, as far as they
/// exist.
std::vector<TomlSection> scan_toml(std::string_view text);
/// The pairs of an inline table, and the elements of an array; `span` is the value. Empty if it is
/// not one.
std::vector<TomlPair> inline_pairs(std::string_view text, const TextSpan& span);
std::vector<TextSpan> array_elements(std::string_view text, const TextSpan& span);

}  // namespace modar
