// Names that a person may have meant, for errors that suggest one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace modar {

/// Letters to insert, take out or replace that lead from one word to the other (Levenshtein 1966).
inline std::size_t edits_between(std::string_view from, std::string_view to) {
  std::vector<std::size_t> row(to.size() + 1);
  for (std::size_t i = 0; i < row.size(); ++i) row[i] = i;
  for (std::size_t i = 1; i <= from.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= to.size(); ++j) {
      const std::size_t replaced = diagonal + (from[i - 1] == to[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

/// The name with the fewest edits, at most half of the word's letters; empty where none is near.
/// names: a range of what converts to std::string_view.
template <class Names>
std::string_view nearest_name(std::string_view word, const Names& names) {
  std::string_view nearest;
  std::size_t fewest = word.size() / 2 + 1;
  for (const std::string_view name : names) {
    const std::size_t edits = edits_between(word, name);
    if (edits >= fewest) continue;
    fewest = edits;
    nearest = name;
  }
  return nearest;
}

/// The cure of an error about a name that is not one of these.
template <class Names>
std::string cure_of_name(std::string_view word, const Names& names) {
  const std::string_view nearest = nearest_name(word, names);
  if (!nearest.empty()) return "did you mean '" + std::string(nearest) + "'?";
  std::string list;
  for (const std::string_view name : names) list += (list.empty() ? "" : ", ") + std::string(name);
  return "name one of: " + (list.empty() ? "(none)" : list);
}

}  // namespace modar
