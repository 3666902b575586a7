// Classes of characters of OBJ text, whatever the locale.
#pragma once

namespace modar {

/// What separates the words of a statement. A NUL counts too: damaged files hold them.
constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\0';
}
constexpr bool is_line_end(char c) {
  return c == '\n' || c == '\r';
}
constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

}  // namespace modar
