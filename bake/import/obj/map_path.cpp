// Names of files as exporters write them, to paths that exist.
#include "bake/import/obj/map_path.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <system_error>
#include <vector>

namespace modar {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && !error;
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool same_but_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

/// The entry of `folder` named `name` in any case: the exact one if there is one, else the first in
/// byte order, so that the answer does not hang on the file system's order.
fs::path entry_of(const fs::path& folder, const std::string& name) {
  std::error_code error;
  if (name == "." || name == "..") return folder / name;
  if (fs::exists(folder / name, error) && !error) return folder / name;
  std::string best;
  fs::directory_iterator it(folder.empty() ? fs::path(".") : folder, error);
  for (; !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string entry = it->path().filename().string();
    if (same_but_case(entry, name) && (best.empty() || entry < best)) best = entry;
  }
  return best.empty() ? fs::path() : folder / best;
}

/// A relative path whose parts may stand in any case.
fs::path any_case(const fs::path& folder, const fs::path& relative) {
  fs::path at = folder;
  for (const fs::path& part : relative) {
    if (part.empty()) continue;
    at = entry_of(at, part.string());
    if (at.empty()) return {};
  }
  return is_file(at) ? at : fs::path();
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Quotes off, escaped blanks to blanks, backslashes to slashes.
std::string cleaned(std::string_view name) {
  name = trimmed(name);
  if (name.size() >= 2 && (name.front() == '"' || name.front() == '\'') &&
      name.back() == name.front()) {
    name = trimmed(name.substr(1, name.size() - 2));
  }
  std::string clean;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] != '\\') {
      clean += name[i];
    } else if (i + 1 < name.size() && name[i + 1] == ' ') {
      continue;
    } else if (clean.empty() || clean.back() != '/') {
      clean += '/';
    }
  }
  return clean;
}

bool is_number(std::string_view token) {
  if (!token.empty() && token.front() == '+') token.remove_prefix(1);
  double value = 0;
  const auto result = std::from_chars(token.data(), token.data() + token.size(), value);
  return result.ec == std::errc() && result.ptr == token.data() + token.size();
}

/// Takes the next word off the front of `text`.
std::string_view take_word(std::string_view& text) {
  text = trimmed(text);
  const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
  const std::string_view word = text.substr(0, end);
  text = trimmed(text.substr(end));
  return word;
}

/// Sets aside the options that the MTL specification knows, with their arguments.
std::string_view without_options(std::string_view text, bool& transformed) {
  while (true) {
    text = trimmed(text);
    std::string_view rest = text;
    const std::string_view option = take_word(rest);
    if (option.size() < 2 || option.front() != '-') return text;
    const std::string_view name = option.substr(1);
    if (name == "o" || name == "s" || name == "t") {
      const double neutral = name == "s" ? 1.0 : 0.0;
      for (int i = 0; i < 3; ++i) {
        std::string_view after = rest;
        const std::string_view word = take_word(after);
        if (!is_number(word) || after.empty()) break;
        double value = neutral;
        const std::size_t sign = word.front() == '+' ? 1 : 0;
        std::from_chars(word.data() + sign, word.data() + word.size(), value);
        transformed = transformed || value != neutral;
        rest = after;
      }
    } else if (name == "mm") {
      take_word(rest);
      take_word(rest);
    } else if (name == "blendu" || name == "blendv" || name == "clamp" || name == "cc" ||
               name == "imfchan" || name == "texres" || name == "bm" || name == "boost" ||
               name == "type") {
      take_word(rest);
    } else {
      return text;
    }
    text = rest;
  }
}

}  // namespace

std::string find_named_file(std::string_view name, const std::string& folder) {
  const fs::path base(folder);
  const fs::path raw(trimmed(name));
  if (raw.empty() || raw.string().find('\0') != std::string::npos) return {};
  if (is_file(base / raw)) return (base / raw).string();
  const fs::path clean(cleaned(name));
  if (clean.empty()) return {};
  if (is_file(base / clean)) return (base / clean).lexically_normal().string();
  if (clean.is_relative()) {
    if (const fs::path found = any_case(base, clean.lexically_normal()); !found.empty()) {
      return found.string();
    }
  }
  return any_case(base, clean.filename()).string();
}

std::string find_map_file(std::string_view statement, const std::string& folder, std::string& name,
                          bool& transformed) {
  transformed = false;
  std::string_view rest = without_options(statement, transformed);
  name = std::string(rest);
  if (std::string found = find_named_file(rest, folder); !found.empty()) return found;
  // Options after the name, then options that nobody knows before it.
  const std::size_t option = rest.find(" -");
  if (option != std::string_view::npos && option > 0) {
    const std::string_view head = rest.substr(0, option);
    if (std::string found = find_named_file(head, folder); !found.empty()) {
      name = std::string(head);
      return found;
    }
  }
  if (rest.empty() || rest.front() != '-') return {};
  for (int words = 0; words < 32 && !rest.empty(); ++words) {
    take_word(rest);
    if (std::string found = find_named_file(rest, folder); !found.empty()) {
      name = std::string(rest);
      return found;
    }
  }
  return {};
}

}  // namespace modar
