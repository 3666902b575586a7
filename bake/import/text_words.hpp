// Words of a line of a text format.
#pragma once

#include <string_view>

#include "bake/import/obj/number_parser.hpp"

namespace modar {

/// The next word of a line, which loses it; empty at the end. A carriage return is a blank.
inline std::string_view next_word(std::string_view& line) {
  const auto blank = [](char c) { return is_blank(c) || c == '\r'; };
  while (!line.empty() && blank(line.front())) line.remove_prefix(1);
  std::size_t length = 0;
  while (length < line.size() && !blank(line[length])) ++length;
  const std::string_view word = line.substr(0, length);
  line.remove_prefix(length);
  return word;
}

}  // namespace modar
