// Numbers in the checker's words: the fewest digits that read back the same, in any locale.
#include <locale.h>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>

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

TEST(NumberText, NoLocaleShows) {
  const locale_t german = newlocale(LC_NUMERIC_MASK, "de_DE.UTF-8", nullptr);
  if (german == nullptr) GTEST_SKIP() << "no locale with a decimal comma is installed";
  const locale_t before = uselocale(german);
  const std::string text = number_text(0.25);
  uselocale(before);
  freelocale(german);
  EXPECT_EQ(text, "0.25");
}

}  // namespace
}  // namespace modar
