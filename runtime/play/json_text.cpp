#include "json_text.hpp"

#include <cmath>

#include "formats/rules.hpp"

namespace modar {

void JsonText::comma() {
  constexpr std::string_view kOpen = "{[:";
  if (!text_.empty() && kOpen.find(text_.back()) == std::string_view::npos) text_ += ',';
}

void JsonText::key(std::string_view name) {
  text(name);
  text_ += ':';
}

void JsonText::text(std::string_view value) {
  constexpr std::string_view kHex = "0123456789abcdef";
  comma();
  text_ += '"';
  for (const char letter : value) {
    const auto code = static_cast<unsigned char>(letter);
    if (code < 0x20) {
      text_ += "\\u00";
      text_ += kHex[code >> 4];
      text_ += kHex[code & 15u];
      continue;
    }
    if (letter == '"' || letter == '\\') text_ += '\\';
    text_ += letter;
  }
  text_ += '"';
}

void JsonText::number(double value) {
  comma();
  text_ += std::isfinite(value) ? number_text(value) : "null";
}

void JsonText::count(std::uint64_t value) {
  comma();
  text_ += std::to_string(value);
}

void JsonText::flag(bool value) {
  comma();
  text_ += value ? "true" : "false";
}

void JsonText::open(char bracket) {
  comma();
  text_ += bracket;
}

void JsonText::close(char bracket) {
  text_ += bracket;
}

}  // namespace modar
