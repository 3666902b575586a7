#include "bake/project/project_edit.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bake/project/file_digests.hpp"
#include "bake/project/toml_scan.hpp"
#include "formats/base/ranges.hpp"
#include "formats/base/shortest_number.hpp"
#include "formats/base/utf8.hpp"

namespace modar {
namespace {

using Key = std::vector<std::string>;

tl::unexpected<Error> no_edit(const std::string& cause) {
  return fail(ExitCode::kUsage, "project.edit", "", cause, "reload the page");
}

/// A text in quotes as TOML has it.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (c == '\n') {
      out += "\\n";
    } else if (c == '\t') {
      out += "\\t";
    } else if (byte < 0x20 || byte == 0x7F) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04X", byte);
      out += code;
    } else {
      out += c;
    }
  }
  return out + "\"";
}

/// With control characters, which are escaped.
bool is_any_utf8(std::string_view text) {
  while (!text.empty()) {
    const auto byte = static_cast<unsigned char>(text[0]);
    const bool control = byte < 0x20 || byte == 0x7F;
    const bool c1 = text.size() > 1 && byte == 0xC2 && static_cast<unsigned char>(text[1]) < 0xA0 &&
                    static_cast<unsigned char>(text[1]) >= 0x80;
    const std::size_t size = control ? 1 : c1 ? 2 : utf8_character(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

Result<std::string> toml_of(const Json& value) {
  if (const auto text = value.text()) {
    if (!is_any_utf8(*text)) return no_edit("the text is not UTF-8");
    return quoted(*text);
  }
  if (const auto truth = value.truth()) return std::string(*truth ? "true" : "false");
  if (const auto number = value.number()) {
    if (!std::isfinite(*number)) return no_edit("the number is not finite");
    std::string digits = shortest_text(*number);
    // TOML asks for digits on both sides of a point; whole numbers stand without one.
    if (const std::size_t e = digits.find("e+"); e != std::string::npos) digits.erase(e + 1, 1);
    return digits;
  }
  if (!value.is_array()) return no_edit("modar.toml holds no such value");
  std::string list = "[";
  for (std::size_t i = 0; i < value.size(); ++i) {
    MODAR_ASSIGN(const std::string element, toml_of(*value.at(i)));
    list += (i == 0 ? "" : ", ") + element;
  }
  return list + "]";
}

/// "text.en" to its parts. Keys of modar.toml have no dots themselves.
Key parts_of(const std::string& key) {
  Key parts(1);
  for (const char c : key) {
    if (c == '.') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

bool is_bare(const std::string& part) {
  return !part.empty() && std::all_of(part.begin(), part.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  });
}

std::string text_of(const Key& key) {
  std::string text;
  for (const std::string& part : key) {
    text += (text.empty() ? "" : ".") + (is_bare(part) ? part : quoted(part));
  }
  return text;
}

Key rest_of(const Key& key, std::size_t from) {
  return {key.begin() + static_cast<std::ptrdiff_t>(from), key.end()};
}

bool starts_with(const Key& key, const Key& start) {
  return key.size() >= start.size() && std::equal(start.begin(), start.end(), key.begin());
}

/// Lines end as those of the file do.
std::string line_break(const std::string& text) {
  const std::size_t end = text.find('\n');
  return end != std::string::npos && end > 0 && text[end - 1] == '\r' ? "\r\n" : "\n";
}

/// Behind the line of `at`, its line break included.
std::size_t line_end(const std::string& text, std::size_t at) {
  const std::size_t end = text.find('\n', at);
  return end == std::string::npos ? text.size() : end + 1;
}

std::size_t line_begin(const std::string& text, std::size_t at) {
  const std::size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  return before == std::string::npos ? 0 : before + 1;
}

bool is_blank_line(const std::string& text, std::size_t begin) {
  const std::size_t found = text.find_first_not_of(" \t\r", begin);
  return found == std::string::npos || text[found] == '\n';
}

void replace(std::string& text, const TextSpan& span, const std::string& by) {
  text.replace(span.begin, span.end - span.begin, by);
}

/// A table of the text: sections that begin with its own, or a value between braces.
struct Place {
  bool there = false;
  std::size_t first = 0;  ///< section of its header, or of what sets it
  std::size_t last = 0;   ///< behind the sections of tables within it
  Key prefix;             ///< of its keys there: "project" of a "project.name" above all headers
  TextSpan braces;        ///< empty: it has a section
};

class Editor {
 public:
  explicit Editor(const std::string& text) : text_(text), sections_(scan_toml(text)) {}

  [[nodiscard]] const std::vector<TomlSection>& sections() const { return sections_; }

  [[nodiscard]] std::size_t count(const std::string& name) const {
    std::size_t headers = 0;
    for (const TomlSection& section : sections_) {
      headers += section.listed && section.name == Key{name} ? 1U : 0U;
    }
    const TomlPair* list = find_pair(sections_[0].pairs, {name});
    return headers + (list == nullptr ? 0 : array_elements(text_, list->value).size());
  }

  [[nodiscard]] Place find(const TableName& table) const {
    Place place;
    const Key name = {table.name};
    std::size_t seen = 0;
    for (std::size_t i = 1; i < sections_.size(); ++i) {
      const TomlSection& section = sections_[i];
      if (section.name != name || section.listed != table.index.has_value()) continue;
      if (table.index && seen++ != *table.index) continue;
      place.there = true;
      place.first = i;
      place.last = i + 1;
      while (place.last < sections_.size() && sections_[place.last].name.size() > 1 &&
             starts_with(sections_[place.last].name, name)) {
        ++place.last;
      }
      return place;
    }
    return find_above(table);
  }

  [[nodiscard]] static const TomlPair* find_pair(const std::vector<TomlPair>& pairs,
                                                 const Key& key) {
    const auto found = ranges::find(pairs, key, &TomlPair::key);
    return found == pairs.end() ? nullptr : &*found;
  }

  /// The value of a key of the table, and the pair that holds it.
  struct Found {
    std::optional<TextSpan> value;
    TomlPair pair;
    TextSpan braces;               ///< that contains the pair; empty: lines
    std::vector<TomlPair> beside;  ///< all pairs there
  };
  [[nodiscard]] Found find_key(const Place& place, const Key& key) const {
    if (place.braces.end > place.braces.begin) {
      return find_in(inline_pairs(text_, place.braces), place.braces, key);
    }
    Key whole = place.prefix;
    whole.insert(whole.end(), key.begin(), key.end());
    Found found = find_in(sections_[place.first].pairs, {}, whole);
    for (std::size_t i = place.first + 1; i < place.last && !found.value; ++i) {
      // [scene.text] of a "text.en"; not [[scene.label]].
      const Key within = rest_of(sections_[i].name, 1);
      if (sections_[i].listed || !starts_with(key, within)) continue;
      found = find_in(sections_[i].pairs, {}, rest_of(key, within.size()));
    }
    return found;
  }

  [[nodiscard]] std::string set(const Place& place, const Key& key,
                                const std::string& value) const {
    std::string out = text_;
    const Found found = find_key(place, key);
    if (found.value) {
      replace(out, *found.value, value);
    } else if (const TextSpan braces = braces_for(place, key); braces.end > braces.begin) {
      insert_between(out, braces, tail_between(place, key), value);
    } else {
      insert_line(out, place, key, value);
    }
    return out;
  }

  [[nodiscard]] std::string remove(const Place& place, const Key& key) const {
    std::string out = text_;
    const Found found = find_key(place, key);
    if (!found.value) return out;
    if (found.braces.end == found.braces.begin) {
      out.erase(found.pair.whole.begin,
                line_end(text_, found.pair.whole.end) - found.pair.whole.begin);
      const std::size_t begin = line_begin(text_, found.pair.whole.begin);
      out.erase(begin, found.pair.whole.begin - begin);  // its indentation
      return out;
    }
    TextSpan span = found.pair.whole;
    const std::size_t index = index_of(found.beside, found.pair);
    if (index + 1 < found.beside.size()) {
      span.end = found.beside[index + 1].whole.begin;
    } else if (index > 0) {
      span.begin = found.beside[index - 1].whole.end;
    }
    out.erase(span.begin, span.end - span.begin);
    return out;
  }

  [[nodiscard]] std::string remove(const Place& place) const {
    std::string out = text_;
    if (place.braces.end > place.braces.begin) {
      TextSpan span = place.braces;  // an element of an array: with the comma behind or before it
      const std::size_t after = text_.find_first_not_of(" \t\r\n", span.end);
      if (after != std::string::npos && text_[after] == ',') {
        const std::size_t next = text_.find_first_not_of(" \t\r\n", after + 1);
        span.end = next == std::string::npos ? after + 1 : next;
      } else {
        const std::size_t before = text_.find_last_not_of(" \t\r\n", span.begin - 1);
        if (before != std::string::npos && text_[before] == ',') span.begin = before;
      }
      out.erase(span.begin, span.end - span.begin);
      return out;
    }
    const std::size_t begin = line_begin(text_, sections_[place.first].header.begin);
    std::size_t end = begin;
    for (std::size_t i = place.first; i < place.last; ++i) end = std::max(end, end_of(i));
    // Commented lines right below belong to it, as does one blank line.
    while (end < text_.size() && !is_blank_line(text_, end) &&
           text_[text_.find_first_not_of(" \t", end)] == '#') {
      end = line_end(text_, end);
    }
    if (end < text_.size() && is_blank_line(text_, end)) end = line_end(text_, end);
    out.erase(begin, end - begin);
    return out;
  }

  /// Behind the last line of a section's pairs.
  [[nodiscard]] std::size_t end_of(std::size_t section) const {
    const TomlSection& one = sections_[section];
    if (!one.pairs.empty()) return line_end(text_, one.pairs.back().whole.end);
    return one.header.end == 0 ? 0 : line_end(text_, one.header.end);
  }

 private:
  /// "name = {...}", "name = [{...}]" or "name.key = ..." above all headers.
  [[nodiscard]] Place find_above(const TableName& table) const {
    Place place;
    place.last = 1;
    const TomlPair* pair = find_pair(sections_[0].pairs, {table.name});
    if (table.index) {
      const auto elements =
          pair == nullptr ? std::vector<TextSpan>() : array_elements(text_, pair->value);
      place.there = *table.index < elements.size();
      if (place.there) place.braces = elements[*table.index];
      return place;
    }
    if (pair != nullptr) {
      place.there = true;
      place.braces = pair->value;
      return place;
    }
    place.there = std::any_of(sections_[0].pairs.begin(), sections_[0].pairs.end(),
                              [&](const TomlPair& one) { return one.key[0] == table.name; });
    place.prefix = {table.name};
    return place;
  }

  [[nodiscard]] static std::size_t index_of(const std::vector<TomlPair>& pairs,
                                            const TomlPair& pair) {
    const auto found = ranges::find_if(
        pairs, [&](const TomlPair& one) { return one.whole.begin == pair.whole.begin; });
    return static_cast<std::size_t>(found - pairs.begin());
  }

  [[nodiscard]] Found find_in(const std::vector<TomlPair>& pairs, const TextSpan& braces,
                              const Key& key) const {
    for (const TomlPair& pair : pairs) {
      if (pair.key == key) return {pair.value, pair, braces, pairs};
      if (!starts_with(key, pair.key)) continue;
      Found within =
          find_in(inline_pairs(text_, pair.value), pair.value, rest_of(key, pair.key.size()));
      if (within.value) return within;
    }
    return {};
  }

  /// The braces that a new key belongs between: those of its table, or of "text = {...}".
  [[nodiscard]] TextSpan braces_for(const Place& place, const Key& key) const {
    if (key.size() > 1) {
      const Found above = find_key(place, {key[0]});
      if (above.value && text_[above.value->begin] == '{') return *above.value;
    }
    return place.braces;
  }
  [[nodiscard]] Key tail_between(const Place& place, const Key& key) const {
    const TextSpan braces = braces_for(place, key);
    const bool own = braces.begin == place.braces.begin && braces.end == place.braces.end;
    return own ? key : rest_of(key, 1);
  }

  static void insert_between(std::string& out, const TextSpan& braces, const Key& key,
                             const std::string& value) {
    const auto pairs = inline_pairs(out, braces);
    const std::string pair = text_of(key) + " = " + value;
    if (pairs.empty()) {
      replace(out, braces, "{ " + pair + " }");
    } else {
      out.insert(pairs.back().whole.end, ", " + pair);
    }
  }

  void insert_line(std::string& out, const Place& place, const Key& key,
                   const std::string& value) const {
    std::size_t section = place.first;
    Key whole = place.prefix;
    whole.insert(whole.end(), key.begin(), key.end());
    for (std::size_t i = place.first + 1; key.size() > 1 && i < place.last; ++i) {
      const Key within = rest_of(sections_[i].name, 1);
      if (sections_[i].listed || within != Key{key[0]}) continue;
      section = i;
      whole = rest_of(key, 1);
    }
    std::size_t at = end_of(section);
    if (place.first == 0) at = end_above(place.prefix);
    // Next to its like: "text.de" behind "text.en".
    for (const TomlPair& pair : sections_[section].pairs) {
      const bool like = whole.size() > 1 && pair.key.size() == whole.size() &&
                        std::equal(pair.key.begin(), pair.key.end() - 1, whole.begin());
      if (like) at = line_end(text_, pair.whole.end);
    }
    const std::string end = line_break(text_);
    const bool open = at > 0 && text_[at - 1] != '\n';
    out.insert(at, (open ? end : "") + text_of(whole) + " = " + value + end);
  }

  /// Above all headers, behind the keys of a table.
  [[nodiscard]] std::size_t end_above(const Key& prefix) const {
    std::size_t at = end_of(0);
    for (const TomlPair& pair : sections_[0].pairs) {
      if (starts_with(pair.key, prefix)) at = line_end(text_, pair.whole.end);
    }
    return at;
  }

  const std::string& text_;
  std::vector<TomlSection> sections_;
};

std::string name_of(const TableName& table) {
  return table.index ? "[[" + table.name + "]] " + std::to_string(*table.index + 1)
                     : "[" + table.name + "]";
}

}  // namespace

std::string revision_of(std::string_view text) {
  return digest_of(text);
}

std::size_t count_tables(const std::string& text, const std::string& name) {
  return Editor(text).count(name);
}

std::optional<std::string> value_text(const std::string& text, const TableName& table,
                                      const std::string& key) {
  const Editor editor(text);
  const Place place = editor.find(table);
  if (!place.there) return std::nullopt;
  const auto found = editor.find_key(place, parts_of(key));
  if (!found.value) return std::nullopt;
  return text.substr(found.value->begin, found.value->end - found.value->begin);
}

Result<std::string> set_key(const std::string& text, const TableName& table, const std::string& key,
                            const Json& value) {
  const Key parts = parts_of(key);
  if (std::any_of(parts.begin(), parts.end(), [](const auto& part) { return part.empty(); })) {
    return no_edit("'" + key + "' is no key");
  }
  MODAR_ASSIGN(const std::string written, toml_of(value));
  const Editor editor(text);
  const Place place = editor.find(table);
  if (place.there) return editor.set(place, parts, written);
  if (table.index) return no_edit("there is no " + name_of(table));
  const std::string end = line_break(text);
  const std::string gap = text.empty() ? "" : text.ends_with('\n') ? end : end + end;
  return text + gap + "[" + table.name + "]" + end + text_of(parts) + " = " + written + end;
}

Result<std::string> remove_key(const std::string& text, const TableName& table,
                               const std::string& key) {
  const Editor editor(text);
  const Place place = editor.find(table);
  if (!place.there) {
    return table.index ? Result<std::string>(no_edit("there is no " + name_of(table))) : text;
  }
  return editor.remove(place, parts_of(key));
}

Result<std::string> add_table(const std::string& text, const std::string& name, const Json& keys) {
  const Editor editor(text);
  const std::string end = line_break(text);
  std::string lines;
  std::string pairs;
  for (const std::string& key : keys.keys()) {
    MODAR_ASSIGN(const std::string value, toml_of(*keys.find(key)));
    lines += text_of(parts_of(key)) + " = " + value + end;
    pairs += (pairs.empty() ? "" : ", ") + text_of(parts_of(key)) + " = " + value;
  }
  std::string out = text;
  if (const TomlPair* list = Editor::find_pair(editor.sections()[0].pairs, {name})) {
    const auto elements = array_elements(text, list->value);
    const std::string element = "{ " + pairs + " }";
    if (elements.empty()) {
      replace(out, list->value, "[" + element + "]");
    } else {
      out.insert(elements.back().end, ", " + element);
    }
    return out;
  }
  std::size_t at = text.size();
  const std::size_t count = editor.count(name);
  if (count > 0) {
    const Place last = editor.find({name, count - 1});
    at = 0;
    for (std::size_t i = last.first; i < last.last; ++i) at = std::max(at, editor.end_of(i));
    // Behind commented lines right below.
    while (at < text.size() && !is_blank_line(text, at) &&
           text[text.find_first_not_of(" \t", at)] == '#') {
      at = line_end(text, at);
    }
  }
  const bool open = at > 0 && text[at - 1] != '\n';
  const std::string gap = at == 0 ? "" : open ? end + end : end;
  out.insert(at, gap + "[[" + name + "]]" + end + lines);
  return out;
}

Result<std::string> remove_table(const std::string& text, const TableName& table) {
  const Editor editor(text);
  const Place place = editor.find(table);
  if (!place.there || !table.index) return no_edit("there is no " + name_of(table));
  return editor.remove(place);
}

}  // namespace modar
