// Holds quantisation against oracles made from the definitions in double arithmetic.
#include "formats/quantise.hpp"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace {

/// IEEE 754-2019, 3.4: value of a finite binary16.
double half_value(unsigned bits) {
  const int exponent = static_cast<int>((bits >> 10) & 31u);
  const double mantissa = (bits & 1023u) / 1024.0;
  const double magnitude =
      exponent == 0 ? std::ldexp(mantissa, -14) : std::ldexp(1.0 + mantissa, exponent - 15);
  return (bits & 0x8000u) != 0 ? -magnitude : magnitude;
}

TEST(Half, EveryHalfDecodesToItsValueAndBack) {
  for (unsigned bits = 0; bits < 65536; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    const float value = modar::half_to_float(half);
    if ((bits & 0x7C00u) != 0x7C00u) {
      ASSERT_EQ(static_cast<double>(value), half_value(bits)) << bits;
      ASSERT_EQ(std::signbit(value), (bits & 0x8000u) != 0) << bits;
      ASSERT_EQ(modar::float_to_half(value), half);
    } else if ((bits & 0x3FFu) == 0) {
      ASSERT_TRUE(std::isinf(value));
      ASSERT_EQ(modar::float_to_half(value), half);
    } else {
      ASSERT_TRUE(std::isnan(value)) << bits;
      const unsigned again = modar::float_to_half(value);
      ASSERT_TRUE((again & 0x7C00u) == 0x7C00u && (again & 0x3FFu) != 0) << bits;
    }
  }
}

/// Rounding changes only halfway between neighbours, so trying each such point and the floats on
/// both sides of it tries every float.
TEST(Half, EveryFloatRoundsToTheNearestEven) {
  const float up = std::numeric_limits<float>::infinity();
  for (unsigned bits = 0; bits < 0x7C00u; ++bits) {
    const double low = half_value(bits);
    // Beyond the greatest half, rounding continues as if the next power of two were one.
    const double high = bits == 0x7BFFu ? 65536.0 : half_value(bits + 1);
    const auto middle = static_cast<float>((low + high) / 2);
    ASSERT_EQ(static_cast<double>(middle), (low + high) / 2);
    const unsigned even = bits % 2 == 0 ? bits : bits + 1;
    ASSERT_EQ(modar::float_to_half(middle), even) << bits;
    ASSERT_EQ(modar::float_to_half(std::nextafter(middle, 0.0f)), bits) << bits;
    ASSERT_EQ(modar::float_to_half(std::nextafter(middle, up)), bits + 1) << bits;
    ASSERT_EQ(modar::float_to_half(-middle), even | 0x8000u) << bits;
  }
  EXPECT_EQ(modar::float_to_half(std::numeric_limits<float>::max()), 0x7C00u);
  EXPECT_EQ(modar::float_to_half(std::numeric_limits<float>::denorm_min()), 0u);
  EXPECT_EQ(modar::float_to_half(-0.0f), 0x8000u);
}

/// A NaN whose payload sits in the bits that are lost must not become infinity.
TEST(Half, NotANumberStaysSo) {
  for (const std::uint32_t bits : {0x7F800001u, 0xFF800001u, 0x7FC00000u, 0x7FFFFFFFu}) {
    const unsigned half = modar::float_to_half(std::bit_cast<float>(bits));
    EXPECT_GT(half & 0x7FFFu, 0x7C00u) << bits;
  }
}

TEST(Snorm8, IsTheNearestUnderTheMeanOfBothDecodings) {
  const auto es2 = [](int c) { return (2.0 * c + 1.0) / 255.0; };
  const auto es3 = [](int c) { return std::fmax(c / 127.0, -1.0); };
  for (int i = -30000; i <= 30000; ++i) {
    const float value = static_cast<float>(i) / 25000.0f;
    const double wanted = std::fmin(1.0, std::fmax(-1.0, static_cast<double>(value)));
    double best = 10;
    for (int c = -128; c <= 127; ++c) {
      best = std::fmin(best, std::fabs((es2(c) + es3(c)) / 2 - wanted));
    }
    const int got = modar::float_to_snorm8(value);
    ASSERT_NEAR(std::fabs((es2(got) + es3(got)) / 2 - wanted), best, 1e-12) << value;
    ASSERT_LE(std::fabs(es2(got) - wanted), 1.0 / 127) << value;
    ASSERT_LE(std::fabs(es3(got) - wanted), 1.0 / 127) << value;
  }
  EXPECT_EQ(modar::float_to_snorm8(1.0f), 127);
  EXPECT_EQ(modar::float_to_snorm8(-1.0f), -128);
  EXPECT_EQ(modar::float_to_snorm8(std::nanf("")), 0);
  for (int c = -128; c <= 127; ++c) {
    EXPECT_EQ(modar::snorm8_to_float(static_cast<std::int8_t>(c)), static_cast<float>(es2(c)));
  }
}

/// What the specification says of octahedral normals, at full length.
std::array<double, 3> oct_direction(double x, double y) {
  double z = 1.0 - std::fabs(x) - std::fabs(y);
  if (z < 0) {
    const double old = x;
    x = (1.0 - std::fabs(y)) * (x < 0 ? -1.0 : 1.0);
    y = (1.0 - std::fabs(old)) * (y < 0 ? -1.0 : 1.0);
  }
  const double length = std::sqrt(x * x + y * y + z * z);
  return {x / length, y / length, z / length};
}

TEST(Oct8, IsAsGoodAsTheBestOfAllCodes) {
  const auto worse_degrees = [](int cx, int cy, const std::array<double, 3>& n) {
    double worse = 0;
    for (const bool es3 : {false, true}) {
      const auto decode = [&](int c) {
        return es3 ? std::fmax(c / 127.0, -1.0) : (2.0 * c + 1.0) / 255.0;
      };
      const auto d = oct_direction(decode(cx), decode(cy));
      const double dot = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
      worse = std::fmax(worse, std::acos(std::fmin(1.0, dot)) * 57.29577951308232);
    }
    return worse;
  };
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 150; ++i) {
    std::array<double, 3> n = {normal(random), normal(random), normal(random)};
    if (i % 5 == 0) n[static_cast<std::size_t>(i % 3)] = 0.0;
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (double& c : n) c /= length;
    double best = 180;
    for (int cx = -128; cx <= 127; ++cx) {
      for (int cy = -128; cy <= 127; ++cy) best = std::fmin(best, worse_degrees(cx, cy, n));
    }
    const auto code = modar::normal_to_oct8(n);
    // The codes round a direction nearly always hold the best of all.
    EXPECT_LE(worse_degrees(code[0], code[1], n), best + 0.2) << i;
    EXPECT_LT(worse_degrees(code[0], code[1], n), 1.5) << i;
  }
  for (const auto& n : {std::array<double, 3>{0, 0, 0}, {NAN, 0, 0}}) {
    EXPECT_GT(oct_direction((2.0 * modar::normal_to_oct8(n)[0] + 1) / 255, 0)[2], 0.9);
  }
}

TEST(Unorm, EveryValueComesBackAndBoundsHold) {
  for (unsigned c = 0; c < 65536; ++c) {
    const auto value = static_cast<std::uint16_t>(c);
    ASSERT_EQ(modar::float_to_unorm16(modar::unorm16_to_float(value)), value);
    ASSERT_NEAR(static_cast<double>(modar::unorm16_to_float(value)), c / 65535.0, 6e-8);
  }
  for (unsigned c = 0; c < 256; ++c) {
    const auto value = static_cast<std::uint8_t>(c);
    ASSERT_EQ(modar::float_to_unorm8(static_cast<float>(modar::decode_normalised(value))), value);
    ASSERT_NEAR(static_cast<double>(static_cast<float>(modar::decode_normalised(value))), c / 255.0,
                6e-8);
  }
  for (const float value : {-1.0f, -0.0f, std::nanf(""), -std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(modar::float_to_unorm16(value), 0);
    EXPECT_EQ(modar::float_to_unorm8(value), 0);
  }
  EXPECT_EQ(modar::float_to_unorm16(1.5f), 65535);
  EXPECT_EQ(modar::float_to_unorm8(std::numeric_limits<float>::infinity()), 255);
  EXPECT_EQ(modar::float_to_unorm8(0.5f / 255.0f * 1.01f), 1);
}

}  // namespace
