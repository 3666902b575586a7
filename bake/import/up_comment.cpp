#include "bake/import/up_comment.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace modar {
namespace {

constexpr std::size_t kMostBytes = 4096;

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
}

/// Words of a comment in lower case. A sign stays with the word after it if a blank or the like is
/// before the sign: "-z", but "z-up" is two words.
std::vector<std::string> words_of(std::string_view line) {
  std::vector<std::string> words;
  std::string word;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    char c = i < line.size() ? line[i] : ' ';
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    const bool sign = (c == '-' || c == '+') && word.empty() && (i == 0 || !is_word(line[i - 1])) &&
                      i + 1 < line.size();
    if (is_word(c) || sign) {
      word += c;
    } else if (!word.empty()) {
      words.push_back(std::move(word));
      word.clear();
    }
  }
  return words;
}

/// "z up", "up z", "up axis z", "up axis is z".
std::optional<UpAxis> up_in(const std::vector<std::string>& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] != "up") continue;
    if (i > 0) {
      if (const auto before = up_axis_of(words[i - 1])) return before;
    }
    std::size_t next = i + 1;
    while (next < words.size() &&
           (words[next] == "axis" || words[next] == "is" || words[next] == "vector")) {
      ++next;
    }
    if (next < words.size()) {
      if (const auto after = up_axis_of(words[next])) return after;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<UpAxis> up_in_comments(std::string_view head) {
  head = head.substr(0, kMostBytes);
  std::optional<UpAxis> found;
  while (!head.empty()) {
    const std::size_t end = std::min(head.find('\n'), head.size());
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(std::min(end + 1, head.size()));
    if (!line.starts_with('#') && !line.starts_with("comment")) continue;
    const auto here = up_in(words_of(line));
    if (here && found && *here != *found) return std::nullopt;
    if (here) found = here;
  }
  return found;
}

}  // namespace modar
