#include "bake/project/toml_scan.hpp"

#include <algorithm>
#include <cstdint>

#include "formats/base/utf8.hpp"

namespace modar {
namespace {

class Scanner {
 public:
  Scanner(std::string_view text, std::size_t at) : text_(text), at_(at) {}

  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] bool ended() const { return at_ >= text_.size(); }
  [[nodiscard]] char now() const { return ended() ? '\0' : text_[at_]; }
  void next() { ++at_; }

  void blanks() {
    while (now() == ' ' || now() == '\t') ++at_;
  }
  /// Blanks, line breaks and comments.
  void space() {
    for (;;) {
      if (now() == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (!ended() && (now() == ' ' || now() == '\t' || now() == '\r' || now() == '\n')) {
        ++at_;
      } else {
        return;
      }
    }
  }

  /// "a.'b c'.\"d\"".
  std::vector<std::string> key() {
    std::vector<std::string> parts;
    for (;;) {
      blanks();
      parts.push_back(now() == '"' || now() == '\'' ? quoted() : bare());
      blanks();
      if (now() != '.') return parts;
      ++at_;
    }
  }

  TextSpan value() {
    const std::size_t begin = at_;
    if (now() == '"' || now() == '\'') {
      skip_text();
    } else if (now() == '[' || now() == '{') {
      skip_nested();
    } else {
      at_ = std::min(text_.find_first_of(",]}#\r\n", at_), text_.size());
      while (at_ > begin && (text_[at_ - 1] == ' ' || text_[at_ - 1] == '\t')) --at_;
    }
    return {begin, at_};
  }

 private:
  std::string bare() {
    const std::size_t begin = at_;
    at_ = std::min(text_.find_first_of(" \t\r\n.=]#", at_), text_.size());
    return std::string(text_.substr(begin, at_ - begin));
  }

  /// A key in quotes, without its escapes.
  std::string quoted() {
    const std::size_t begin = at_ + 1;
    const bool literal = now() == '\'';
    skip_text();
    const std::string_view raw = text_.substr(begin, at_ > begin ? at_ - begin - 1 : 0);
    return literal ? std::string(raw) : unescaped(raw);
  }

  static std::string unescaped(std::string_view raw) {
    std::string out;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (raw[i] != '\\' || i + 1 >= raw.size()) {
        out += raw[i];
        continue;
      }
      const char code = raw[++i];
      constexpr std::string_view kCodes = "btnfr";
      constexpr std::string_view kMeant = "\b\t\n\f\r";
      if (const std::size_t found = kCodes.find(code); found != std::string_view::npos) {
        out += kMeant[found];
      } else if (code == 'u' || code == 'U') {
        const std::size_t digits = code == 'u' ? 4 : 8;
        std::uint32_t point = 0;
        for (std::size_t d = 0; d < digits && i + 1 < raw.size(); ++d) {
          const char c = raw[++i];
          point =
              point * 16 + static_cast<std::uint32_t>(c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10);
        }
        append_utf8(out, point);
      } else {
        out += code;
      }
    }
    return out;
  }

  void skip_text() {
    const char mark = now();
    const std::string three(3, mark);
    if (text_.substr(at_, 3) == three) {
      at_ += 3;
      while (!ended() && text_.substr(at_, 3) != three)
        at_ += now() == '\\' && mark == '"' ? 2U : 1U;
      // Up to two marks may precede those that end it.
      at_ = std::min(at_ + 3, text_.size());
      for (int more = 0; more < 2 && now() == mark; ++more) ++at_;
      return;
    }
    ++at_;
    while (!ended() && now() != mark && now() != '\n')
      at_ += now() == '\\' && mark == '"' ? 2U : 1U;
    at_ = std::min(at_ + 1, text_.size());
  }

  /// Arrays and inline tables, whatever is in them.
  void skip_nested() {
    std::size_t depth = 0;
    do {
      const char c = now();
      if (c == '[' || c == '{') ++depth;
      if (c == ']' || c == '}') --depth;
      if (c == '"' || c == '\'') {
        skip_text();
      } else if (c == '#') {
        space();
      } else {
        ++at_;
      }
    } while (depth > 0 && !ended());
  }

  std::string_view text_;
  std::size_t at_;
};

/// "key = value"; false where none follows.
bool parse_pair(Scanner& scan, TomlPair& pair) {
  pair.whole.begin = scan.at();
  pair.key = scan.key();
  if (scan.now() != '=') return false;
  scan.next();
  scan.blanks();
  pair.value = scan.value();
  pair.whole.end = pair.value.end;
  return true;
}

}  // namespace

std::vector<TomlSection> scan_toml(std::string_view text) {
  std::vector<TomlSection> sections(1);
  Scanner scan(text, text.starts_with("\xEF\xBB\xBF") ? 3 : 0);
  for (scan.space(); !scan.ended(); scan.space()) {
    if (scan.now() != '[') {
      TomlPair pair;
      if (!parse_pair(scan, pair)) return sections;
      sections.back().pairs.push_back(std::move(pair));
      continue;
    }
    TomlSection section;
    section.header.begin = scan.at();
    scan.next();
    section.listed = scan.now() == '[';
    if (section.listed) scan.next();
    section.name = scan.key();
    if (scan.now() != ']') return sections;
    scan.next();
    if (section.listed) scan.next();
    section.header.end = scan.at();
    sections.push_back(std::move(section));
  }
  return sections;
}

std::vector<TomlPair> inline_pairs(std::string_view text, const TextSpan& span) {
  std::vector<TomlPair> pairs;
  if (span.begin >= span.end || text[span.begin] != '{') return pairs;
  Scanner scan(text.substr(0, span.end), span.begin + 1);
  for (scan.space(); !scan.ended() && scan.now() != '}'; scan.space()) {
    TomlPair pair;
    if (!parse_pair(scan, pair)) return pairs;
    pairs.push_back(std::move(pair));
    scan.space();
    if (scan.now() == ',') scan.next();
  }
  return pairs;
}

std::vector<TextSpan> array_elements(std::string_view text, const TextSpan& span) {
  std::vector<TextSpan> elements;
  if (span.begin >= span.end || text[span.begin] != '[') return elements;
  Scanner scan(text.substr(0, span.end), span.begin + 1);
  for (scan.space(); !scan.ended() && scan.now() != ']'; scan.space()) {
    const std::size_t before = scan.at();
    elements.push_back(scan.value());
    scan.space();
    if (scan.now() == ',') scan.next();
    if (scan.at() == before) return elements;
  }
  return elements;
}

}  // namespace modar
