// Numbers in the checker's words: the fewest digits that read back the same, in any locale.
#include <locale.h>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "formats/base/shortest_number.hpp"
#include "formats/rules.hpp"

namespace modar {
namespace {

TEST(NumberText, IsTheShortestThatReadsBack) {
  EXPECT_EQ(number_text(0.0), "0");
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(-2.5), "-2.5");
  EXPECT_EQ(number_text(65535.0), "65535");
  EXPECT_EQ(number_text(std::ldexp(1.0, -15)), "3.0517578125e-05");
  EXPECT_EQ(number_text(std::numeric_limits<double>::max()), "1.7976931348623157e+308");
  EXPECT_EQ(number_text(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(number_text(std::numeric_limits<double>::quiet_NaN()), "nan");
}

TEST(NumberText, PagesGetNineDigits) {
  for (const double value : {0.0, 0.1, -2.5, 65535.0, 123456789.0, 0.00012}) {
    EXPECT_EQ(rough_number_text(value), number_text(value));
  }
  EXPECT_EQ(rough_number_text(std::ldexp(1.0, -15)), "3.05175781e-05");
  EXPECT_EQ(rough_number_text(9999999999.0), "1e+10");
  EXPECT_EQ(rough_number_text(-std::numeric_limits<double>::infinity()), "-inf");
  EXPECT_EQ(rough_number_text(std::numeric_limits<double>::quiet_NaN()), "nan");
  std::mt19937_64 random(9);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = random();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isnormal(value)) continue;
    const double read = std::strtod(rough_number_text(value).c_str(), nullptr);
    ASSERT_LE(std::abs(read / value - 1), 1e-8) << value;
  }
}

TEST(NumberText, AnyDoubleReadsBack) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = random();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isfinite(value)) continue;
    EXPECT_EQ(std::strtod(number_text(value).c_str(), nullptr), value);
  }
}

template <class T>
std::string standard_text(T value) {
  std::array<char, 512> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

template <class T, class Bits>
void compare_with_standard(Bits bits) {
  T value = 0;
  std::memcpy(&value, &bits, sizeof value);
  if (!std::isfinite(value)) return;
  EXPECT_EQ(shortest_text(value), standard_text(value));
}

TEST(ShortestText, IsWhatToCharsWrites) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 10000; ++i) {
    compare_with_standard<double>(random());
    compare_with_standard<float>(static_cast<std::uint32_t>(random()));
    // Numbers of the size that bundles hold, and whole ones.
    const double usual = std::ldexp(static_cast<double>(random() >> 40), -static_cast<int>(i % 40));
    EXPECT_EQ(shortest_text(usual), standard_text(usual));
    const auto narrow = static_cast<float>(usual * 1e-3);
    EXPECT_EQ(shortest_text(narrow), standard_text(narrow));
  }
  // Powers of two: their neighbours are not at equal distances.
  for (int power = -1074; power < 1024; ++power) {
    EXPECT_EQ(shortest_text(std::ldexp(1.0, power)), standard_text(std::ldexp(1.0, power)));
  }
  for (int power = -149; power < 128; ++power) {
    EXPECT_EQ(shortest_text(std::ldexp(-1.0f, power)), standard_text(std::ldexp(-1.0f, power)));
  }
  EXPECT_EQ(shortest_text(0.0), "0");
  EXPECT_EQ(shortest_text(-0.0f), "-0");
}

TEST(NumberText, NoLocaleShows) {
  const locale_t german = newlocale(LC_NUMERIC_MASK, "de_DE.UTF-8", nullptr);
  if (german == nullptr) GTEST_SKIP() << "no locale with a decimal comma is installed";
  const locale_t before = uselocale(german);
  const std::string text = number_text(0.25);
  const std::string shortest = shortest_text(0.25);
  uselocale(before);
  freelocale(german);
  EXPECT_EQ(text, "0.25");
  EXPECT_EQ(shortest, "0.25");
}

}  // namespace
}  // namespace modar
