// JSON, written member by member.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "formats/rules.hpp"

namespace modar {

/// Of a value: a text, true or false, or a number, by the shortest digits that read back the same
/// in any locale; null where it is not finite.
class JsonWriter {
 public:
  /// indent: blanks a level, a line for each value; 0: all in one line.
  explicit JsonWriter(std::size_t indent = 0) : indent_(indent) {}

  /// A member of the open object.
  [[gnu::noinline]] void put(const char* key, std::string_view text) {
    name(key);
    quote(text);
  }
  void put(const char* key, const char* text) { put(key, std::string_view(text)); }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  [[gnu::noinline]] void put(const char* key, Number value) {
    name(key);
    write(value);
  }
  /// fill(): writes the members, or the elements.
  template <class Fill>
  void object(const char* key, const Fill& fill) {
    name(key);
    enclose('{', fill, '}');
  }
  template <class Fill>
  void array(const char* key, const Fill& fill) {
    name(key);
    enclose('[', fill, ']');
  }

  /// An element of the open array.
  [[gnu::noinline]] void add(std::string_view text) {
    next();
    quote(text);
  }
  template <class Number>
  requires std::is_arithmetic_v<Number>
  [[gnu::noinline]] void add(Number value) {
    next();
    write(value);
  }
  /// The same, or the whole text.
  template <class Fill>
  void object(const Fill& fill) {
    next();
    enclose('{', fill, '}');
  }
  template <class Fill>
  void array(const Fill& fill) {
    next();
    enclose('[', fill, ']');
  }

  [[nodiscard]] const std::string& str() const { return text_; }

 private:
  // One copy of each in a program: inlined into their many callers they would take 3 KB.
  [[gnu::noinline]] void name(const char* key) {
    next();
    quote(key);
    text_ += indent_ == 0 ? ":" : ": ";
  }
  [[gnu::noinline]] void next() {
    if (!first_) text_ += ',';
    if (depth_ > 0) break_line();
    first_ = false;
  }
  void break_line() {
    if (indent_ > 0) text_.append(1, '\n').append(indent_ * depth_, ' ');
  }
  [[gnu::noinline]] void begin(char bracket) {
    text_ += bracket;
    ++depth_;
    first_ = true;
  }
  [[gnu::noinline]] void end(char bracket) {
    --depth_;
    if (!first_) break_line();
    first_ = false;
    text_ += bracket;
  }
  template <class Fill>
  void enclose(char open, const Fill& fill, char close) {
    begin(open);
    fill();
    end(close);
  }
  template <class Number>
  void write(Number value) {
    if constexpr (std::is_same_v<Number, bool>) {
      text_ += value ? "true" : "false";
    } else if constexpr (std::is_integral_v<Number>) {
      text_ += std::to_string(value);
    } else {
      const auto number = static_cast<double>(value);
      text_ += std::isfinite(number) ? number_text(number) : "null";
    }
  }
  [[gnu::noinline]] void quote(std::string_view text) {
    constexpr std::string_view kHex = "0123456789abcdef";
    text_ += '"';
    for (const char letter : text) {
      const auto code = static_cast<unsigned char>(letter);
      if (code < 0x20) {
        text_.append("\\u00").append(1, kHex[code >> 4]).append(1, kHex[code & 15u]);
        continue;
      }
      if (letter == '"' || letter == '\\') text_ += '\\';
      text_ += letter;
    }
    text_ += '"';
  }

  std::string text_;
  std::size_t indent_;
  std::size_t depth_ = 0;
  bool first_ = true;  ///< of its object or array
};

}  // namespace modar
