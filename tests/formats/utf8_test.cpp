// The bytes allowed in a name.
#include "formats/base/utf8.hpp"

#include "formats/base/address.hpp"

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

TEST(Addresses, LeadWhereTheyAreReadToLead) {
  for (const char* good :
       {"https://museum.org", "https://museum.org/vase?a=b@c#@", "https://museum.org:8443/@a",
        "https://el.wikipedia.org/wiki/\xCE\x92\xCE\xAC\xCE\xB6\xCE\xBF",
        "mailto:access@museum.org", "imprint.html"}) {
    EXPECT_EQ(modar::address_fault(good), nullptr) << good;
  }
  for (const char* bad :
       {"https://museum.org@evil.example", "https://a:b@evil.example/", "https://@evil.example?",
        "http://museum.org\\@evil.example", "https://", "https:///vase", "https://?a",
        "https://museum.org/a b", "https://museum.org/\x1B[2J", "https://museum.org/\xFF"}) {
    EXPECT_NE(modar::address_fault(bad), nullptr) << bad;
  }
  // Unicode's bidirectional controls and default ignorable code points (DerivedCoreProperties.txt),
  // next to ones that are seen.
  for (const unsigned point :
       {0xADu,   0x34Fu,  0x61Cu,   0x115Fu,  0x17B4u,  0x180Eu,  0x200Bu,  0x200Eu, 0x200Fu,
        0x2028u, 0x202Au, 0x202Eu,  0x2060u,  0x2066u,  0x2069u,  0x206Fu,  0x3164u, 0xFE0Fu,
        0xFEFFu, 0xFFA0u, 0x1BCA3u, 0x1D17Au, 0xE0001u, 0xE01EFu, 0xE0FFFu, 0x3000u}) {
    EXPECT_NE(modar::address_fault("https://museum.org/" + encoded(point)), nullptr)
        << std::hex << point;
  }
  for (const unsigned point : {0x21u, 0xA1u, 0xAEu, 0x61Bu, 0x2010u, 0x2027u, 0x2030u, 0x205Eu,
                               0x2070u, 0xFE10u, 0xFFFCu, 0x1F600u}) {
    EXPECT_EQ(modar::address_fault("https://museum.org/" + encoded(point)), nullptr)
        << std::hex << point;
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
