// Decimal to double, against the C library's correctly rounded strtod.
#include "bake/import/obj/number_parser.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

namespace modar {
namespace {

struct Parsed {
  double value = 0;
  NumberKind kind = NumberKind::kNone;
  std::size_t length = 0;
};

Parsed parse_text(const std::string& text) {
  const std::string padded = text + std::string(kTextPadding, '\0');
  Parsed result;
  const char* end =
      parse_real(padded.data(), padded.data() + text.size(), result.value, result.kind);
  result.length = static_cast<std::size_t>(end - padded.data());
  return result;
}

void expect_same_as_strtod(const std::string& text) {
  const Parsed ours = parse_text(text);
  char* end = nullptr;
  const double theirs = std::strtod(text.c_str(), &end);
  EXPECT_EQ(ours.kind, NumberKind::kFinite) << text;
  EXPECT_EQ(std::bit_cast<std::uint64_t>(ours.value), std::bit_cast<std::uint64_t>(theirs)) << text;
  EXPECT_EQ(ours.length, static_cast<std::size_t>(end - text.c_str())) << text;
}

TEST(NumberParser, FormatsThatExportersWrite) {
  for (const char* text : {"0",
                           "-0",
                           "+0",
                           "1",
                           "-1",
                           "+1",
                           ".5",
                           "-.5",
                           "2.",
                           "+2.",
                           "1e2",
                           "2.e1",
                           "3.1e2",
                           "-1e-3",
                           "1E10",
                           "2.e01",
                           ".8e-001",
                           "000123.4500",
                           "1e-400",
                           "12345678",
                           "123456789",
                           "1234567890",
                           "0.000000001",
                           "3.14159265358979323846264338327950288",
                           "9007199254740993",
                           "9007199254740992.5",
                           "1.7976931348623157e308",
                           "4.9e-324",
                           "2.2250738585072011e-308",
                           "6648378.3181",
                           "349011.8489",
                           "-2.3360191035254516",
                           "0.1",
                           "1.00000000000000011102230246251565"}) {
    expect_same_as_strtod(text);
  }
}

TEST(NumberParser, RandomNumbersAreCorrectlyRounded) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 200000; ++i) {
    const std::uint64_t r = random();
    std::string text = (r & 1) != 0 ? "-" : "";
    const unsigned before = static_cast<unsigned>((r >> 1) % 9);
    const unsigned after = static_cast<unsigned>((r >> 8) % 19);
    if (before + after == 0) continue;
    for (unsigned d = 0; d < before; ++d) text += static_cast<char>('0' + random() % 10);
    if (after != 0 || (r >> 20) % 2 != 0) text += '.';
    for (unsigned d = 0; d < after; ++d) text += static_cast<char>('0' + random() % 10);
    if ((r >> 24) % 8 == 0) text += "e" + std::to_string(static_cast<int>((r >> 30) % 40) - 20);
    expect_same_as_strtod(text);
    if (HasFailure()) return;
  }
}

TEST(NumberParser, WhatIsNoFiniteNumberSaysSo) {
  for (const char* text : {"nan", "NaN", "-nan", "inf", "-INF", "Infinity", "1e999"}) {
    EXPECT_EQ(parse_text(text).kind, NumberKind::kNotFinite) << text;
    EXPECT_EQ(parse_text(text).length, std::string(text).size()) << text;
  }
  for (const char* text : {"", "-", "+", ".", "-.", "x", "e5", "--1"}) {
    EXPECT_EQ(parse_text(text).kind, NumberKind::kNone) << text;
    EXPECT_EQ(parse_text(text).length, 0u) << text;
  }
}

TEST(NumberParser, StopsAtWhatBelongsToNoNumber) {
  EXPECT_EQ(parse_text("3.1+e2").length, 3u);
  EXPECT_EQ(parse_text("1.5.5").length, 3u);
  EXPECT_EQ(parse_text("7/8").length, 1u);
  EXPECT_EQ(parse_text("1, 5").length, 1u);
  EXPECT_EQ(parse_text("1,5,5").length, 3u);
}

TEST(NumberParser, CommasBetweenDigitsArePoints) {
  for (const auto& [text, value] :
       {std::pair{"1,5", 1.5}, std::pair{"-0,600000024", -0.600000024},
        std::pair{"+2,5E-3", 2.5e-3},
        std::pair{"123456789012345678901,5", 123456789012345678901.5}}) {
    const Parsed parsed = parse_text(text);
    EXPECT_EQ(parsed.value, value) << text;
    EXPECT_EQ(parsed.length, std::string(text).size()) << text;
  }
}

}  // namespace
}  // namespace modar
