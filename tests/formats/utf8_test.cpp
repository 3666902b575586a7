// Which bytes may stand in a name.
#include "formats/base/utf8.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace {

using modar::utf8_character;

/// RFC 3629: the bytes of one code point.
std::string encoded(unsigned point) {
  const auto byte = [](unsigned value) { return static_cast<char>(value); };
  const auto tail = [&](unsigned shift) { return byte(0x80u | ((point >> shift) & 0x3Fu)); };
  if (point < 0x80) return {byte(point)};
  if (point < 0x800) return {byte(0xC0u | (point >> 6)), tail(0)};
  if (point < 0x10000) return {byte(0xE0u | (point >> 12)), tail(6), tail(0)};
  return {byte(0xF0u | (point >> 18)), tail(12), tail(6), tail(0)};
}

TEST(Utf8, TakesEveryPrintableCodePoint) {
  for (unsigned point = 0; point <= 0x10FFFF; ++point) {
    const std::string text = encoded(point);
    const bool control = point < 0x20 || (point >= 0x7F && point < 0xA0);
    const bool surrogate = point >= 0xD800 && point < 0xE000;
    ASSERT_EQ(utf8_character(text), control || surrogate ? 0 : text.size()) << std::hex << point;
    ASSERT_EQ(utf8_character(std::string_view(text).substr(0, text.size() - 1)), 0u);
  }
}

TEST(Utf8, RefusesOverlongAndStrayBytes) {
  for (const std::string_view text :
       {"\xC0\x80", "\xC1\xBF", "\xE0\x9F\xBF", "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80",
        "\xF5\x80\x80\x80", "\x80", "\xFF", "\xE2\x82x", "\xF0\x9F\x98x", ""}) {
    EXPECT_EQ(utf8_character(text), 0u) << text.size();
  }
}

}  // namespace
