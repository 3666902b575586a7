// A recursive descent over JSON that keeps nothing.
#include "formats/meta_text.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "formats/base/utf8.hpp"

namespace modar {
namespace {

bool decimal_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Of "\\u12AB"; -1 where the text does not begin with such an escape.
int code_unit(std::string_view text) {
  if (text.size() < 6 || text[0] != '\\' || text[1] != 'u') return -1;
  int unit = 0;
  for (std::size_t i = 2; i < 6; ++i) {
    const char c = text[i];
    const int digit = decimal_digit(c)       ? c - '0'
                      : c >= 'a' && c <= 'f' ? c - 'a' + 10
                      : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                             : -1;
    if (digit < 0) return -1;
    unit = 16 * unit + digit;
  }
  return unit;
}

/// Of a number: more than the shortest text of an f64 takes, and an exponent with which no number
/// of this many digits is beyond an f64.
constexpr std::size_t kMaxNumberBytes = 40;
constexpr unsigned kMaxExponent = 250;

/// Reads values one after the other. What returns a bool is false after a fault; the first one
/// stays.
class JsonScan {
 public:
  explicit JsonScan(std::string_view text) : text_(text) {}

  [[nodiscard]] const std::optional<MetaFault>& fault() const { return fault_; }

  bool refuse(const char* cause) {
    if (!fault_) fault_ = MetaFault{at_, cause};
    return false;
  }

  /// The next character that is no blank; 0 at the end.
  char peek() {
    while (at_ < text_.size() &&
           (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\r' || text_[at_] == '\t')) {
      ++at_;
    }
    return at_ < text_.size() ? text_[at_] : '\0';
  }

  [[nodiscard]] bool at_end() { return peek() == '\0' && at_ == text_.size(); }

  bool string(std::string_view* content = nullptr) {
    if (peek() != '"') return refuse("a string is missing");
    const std::size_t start = ++at_;
    while (at_ < text_.size() && text_[at_] != '"') {
      if (!character()) return false;
    }
    if (at_ == text_.size()) return refuse("a string does not end");
    if (content != nullptr) *content = text_.substr(start, at_ - start);
    ++at_;
    return true;
  }

  /// Any value.
  bool value() {
    switch (peek()) {
      case '{':
        return object([this](std::string_view) { return value(); });
      case '[':
        return array([this] { return value(); });
      case '"':
        return string();
      case 't':
        return word("true");
      case 'f':
        return word("false");
      case 'n':
        return word("null");
      default:
        return number();
    }
  }

  /// member(key): reads the value of a member; the key as written.
  template <class Member>
  bool object(Member member) {
    if (peek() != '{') return refuse("an object is missing");
    return list('}', [&] {
      std::string_view key;
      if (!string(&key)) return false;
      if (peek() != ':') return refuse("a colon is missing");
      ++at_;
      return member(key);
    });
  }

  template <class Element>
  bool array(Element element) {
    if (peek() != '[') return refuse("an array is missing");
    return list(']', element);
  }

 private:
  /// One character of a string, or an escape. Control characters of C1 may be in JSON.
  bool character() {
    const std::string_view rest = text_.substr(at_);
    if (rest[0] == '\\') return escape(rest);
    const bool c1 =
        rest[0] == '\x7F' || (rest.size() > 1 && rest[0] == '\xC2' && utf8_continues(rest[1]));
    const std::size_t size = c1 ? (rest[0] == '\x7F' ? 1 : 2) : utf8_character(rest);
    if (size == 0) return refuse("a byte is not part of a UTF-8 character that a string may hold");
    at_ += size;
    return true;
  }

  bool escape(std::string_view rest) {
    constexpr std::string_view kEscapes = "\"\\/bfnrt";
    if (rest.size() > 1 && kEscapes.find(rest[1]) != std::string_view::npos) {
      at_ += 2;
      return true;
    }
    // Halves of a pair that stand alone are characters to some readers and errors to others.
    const int unit = code_unit(rest);
    const bool first_half = unit >= 0xD800 && unit < 0xDC00;
    const int next = first_half && rest.size() > 6 ? code_unit(rest.substr(6)) : -1;
    const bool good = first_half ? next >= 0xDC00 && next < 0xE000
                                 : unit >= 0 && (unit < 0xDC00 || unit >= 0xE000);
    if (!good) return refuse("a string has an escape that JSON does not define");
    at_ += first_half ? 12 : 6;
    return true;
  }

  bool word(std::string_view expected) {
    if (!text_.substr(at_).starts_with(expected)) return refuse("a value is not a JSON value");
    at_ += expected.size();
    return true;
  }

  bool digits() {
    const std::size_t first = at_;
    while (at_ < text_.size() && decimal_digit(text_[at_])) ++at_;
    return at_ > first;
  }

  bool number() {
    const auto take = [this](char c) {
      const bool there = at_ < text_.size() && text_[at_] == c;
      at_ += there ? 1 : 0;
      return there;
    };
    const std::size_t first = at_;
    take('-');
    const bool zero = take('0');
    bool good = zero || digits();
    if (good && take('.')) good = digits();
    bool small = true;
    if (good && (take('e') || take('E'))) {
      const bool less = !take('+') && take('-');
      const std::size_t start = at_;
      good = digits();
      // Readers differ in what they make of numbers beyond an f64: an infinity, or an error.
      unsigned exponent = 0;
      for (std::size_t i = start; i < at_ && exponent <= kMaxExponent; ++i) {
        exponent = 10 * exponent + static_cast<unsigned>(text_[i] - '0');
      }
      small = less || exponent <= kMaxExponent;
    }
    if (good && small && at_ - first <= kMaxNumberBytes) return true;
    if (good) {
      at_ = first;
      return refuse("a number is too long, or too great for some readers");
    }
    at_ = first;
    return refuse("a value is not a JSON value");
  }

  /// What stands between brackets; the opening one is next.
  template <class Element>
  bool list(char close, Element element) {
    if (++depth_ > kMaxMetaDepth) return refuse("arrays and objects are nested too deeply");
    ++at_;
    if (peek() != close) {
      for (;;) {
        if (!element()) return false;
        if (peek() != ',') break;
        ++at_;
      }
      if (peek() != close) return refuse("a comma or a closing bracket is missing");
    }
    ++at_;
    --depth_;
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  std::optional<MetaFault> fault_;
};

std::optional<MetaText::Kind> kind_of(std::string_view key) {
  if (key == "text") return MetaText::Kind::kText;
  if (key == "alt") return MetaText::Kind::kAlt;
  if (key == "title") return MetaText::Kind::kTitle;
  if (key == "captions") return MetaText::Kind::kCaptions;
  return std::nullopt;
}

/// {"pattern": P, "model": M, "text": {language: words}, "alt": {language: words}}; of a node, N
/// under "node" has to be there, and titles and captions may be.
bool scan_text(JsonScan& scan, bool of_node) {
  bool pattern = false;
  bool node = false;
  bool words = false;
  const bool read = scan.object([&](std::string_view key) {
    const std::optional<MetaText::Kind> kind = kind_of(key);
    if (key == "pattern" || key == (of_node ? "node" : "model")) {
      pattern = pattern || key == "pattern";
      node = node || key == "node";
      return scan.string();
    }
    if (!kind || (*kind >= MetaText::Kind::kTitle && !of_node)) return scan.value();
    words = true;
    return scan.object([&](std::string_view) { return scan.string(); });
  });
  return read && ((pattern && words && node == of_node) ||
                  scan.refuse("a text names no pattern, or has no words"));
}

/// A string's content with its escapes resolved.
std::string unescaped(std::string_view content) {
  std::string out;
  while (!content.empty()) {
    if (content[0] != '\\' || content.size() < 2) {
      out += content[0];
      content.remove_prefix(1);
      continue;
    }
    int unit = code_unit(content);
    if (unit < 0) {
      constexpr std::string_view kWritten = "bfnrt";
      constexpr std::string_view kMeant = "\b\f\n\r\t";
      const std::size_t which = kWritten.find(content[1]);
      out += which == std::string_view::npos ? content[1] : kMeant[which];
      content.remove_prefix(2);
      continue;
    }
    content.remove_prefix(6);
    if (unit >= 0xD800 && unit < 0xDC00) {
      unit = 0x10000 + ((unit - 0xD800) << 10) + (code_unit(content) - 0xDC00);
      content.remove_prefix(std::min<std::size_t>(6, content.size()));
    }
    append_utf8(out, static_cast<std::uint32_t>(unit));
  }
  return out;
}

/// The texts of one element of `texts` or `nodes`, whose pattern may follow them.
bool visit_text(JsonScan& scan, const std::function<void(const MetaText&)>& visit) {
  std::string pattern;
  std::string node;
  std::vector<MetaText> found;
  const bool read = scan.object([&](std::string_view key) {
    std::string_view content;
    if (key == "pattern" || key == "node") {
      if (!scan.string(&content)) return false;
      (key == "node" ? node : pattern) = unescaped(content);
      return true;
    }
    const std::optional<MetaText::Kind> kind = kind_of(key);
    if (!kind) return scan.value();
    return scan.object([&](std::string_view language) {
      if (!scan.string(&content)) return false;
      found.push_back({"", "", *kind, unescaped(language), unescaped(content)});
      return true;
    });
  });
  for (MetaText& each : found) {
    each.pattern = pattern;
    each.node = node;
    visit(each);
  }
  return read;
}

void visit_member(std::string_view text, std::string_view member,
                  const std::function<void(const MetaText&)>& visit) {
  JsonScan scan(text);
  scan.object([&](std::string_view key) {
    if (key != member) return scan.value();
    return scan.array([&] { return visit_text(scan, visit); });
  });
}

bool scan_member(JsonScan& scan, std::string_view key) {
  const auto any_object = [&scan] {
    return scan.object([&](std::string_view) { return scan.value(); });
  };
  if (key.find('\\') != std::string_view::npos) return scan.refuse("a member's name has an escape");
  if (key == "tool") return scan.string();
  if (key == "options") return any_object();
  if (key == "texts" || key == "nodes") {
    return scan.array([&] { return scan_text(scan, key == "nodes"); });
  }
  if (key == "models" || key == "patterns" || key == "scenes") return scan.array(any_object);
  return scan.value();
}

}  // namespace

std::optional<MetaFault> check_meta_text(std::string_view text) {
  JsonScan scan(text);
  const bool read = scan.object([&scan](std::string_view key) { return scan_member(scan, key); });
  if (read && !scan.at_end()) scan.refuse("something follows the object");
  return scan.fault();
}

void visit_meta_texts(std::string_view text, const std::function<void(const MetaText&)>& visit) {
  visit_member(text, "texts", visit);
}

void visit_node_texts(std::string_view text, const std::function<void(const MetaText&)>& visit) {
  visit_member(text, "nodes", visit);
}

}  // namespace modar
