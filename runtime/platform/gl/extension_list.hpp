// Looks a whole name up in a list of extensions separated by blanks.
#pragma once

#include <string_view>

namespace modar {

/// A name that is only the start of a longer one does not count.
inline bool lists_extension(std::string_view list, std::string_view name) {
  std::size_t at = 0;
  while ((at = list.find(name, at)) != std::string_view::npos) {
    const std::size_t end = at + name.size();
    const bool starts = at == 0 || list[at - 1] == ' ';
    const bool ends = end == list.size() || list[end] == ' ';
    if (starts && ends) return true;
    at = end;
  }
  return false;
}

}  // namespace modar
