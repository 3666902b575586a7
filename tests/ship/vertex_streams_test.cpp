// Vertices as integers and back, held against the compiler's own half type.
#include "formats/transport/vertex_streams.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "formats/quantise.hpp"

namespace modar {
namespace {

TEST(VertexStreams, EveryHalfComesBack) {
  int valid = 0;
  for (std::uint32_t bits = 0; bits < 65536; ++bits) {
    const auto half = static_cast<std::uint16_t>(bits);
    _Float16 value;
    std::memcpy(&value, &half, 2);
    const auto x = static_cast<double>(value);
    const auto parts = split_half(half);
    const bool fits = std::abs(x) <= 1 && half != 0x8000;
    ASSERT_EQ(parts.has_value(), fits) << bits;
    if (!fits) continue;
    ++valid;
    EXPECT_EQ((parts->coarse * 8192.0 + parts->fine) / 16777216.0, x);
    const int known = 13 - fine_bits(parts->coarse);
    EXPECT_EQ(parts->fine & ((1u << known) - 1), 0u) << bits;
    EXPECT_EQ(join_half(*parts), half);
  }
  EXPECT_EQ(valid, 2 * 0x3C00 + 1);
}

TEST(VertexStreams, NormalsAreMostlyExactAndAlwaysNear) {
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  int exact = 0;
  for (int i = 0; i < 5000; ++i) {
    const std::array<float, 3> n = {normal(random), normal(random), normal(random)};
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    std::array<std::int8_t, 3> bytes{};
    for (std::size_t c = 0; c < 3; ++c) bytes[c] = float_to_snorm8(n[c] / length);
    const auto direction = octahedral_of_snorm8(bytes, 10);
    EXPECT_EQ(std::abs(direction[0]) + std::abs(direction[1]) + std::abs(direction[2]), 511);
    const double size = std::hypot(direction[0], direction[1], direction[2]);
    bool same = true;
    for (std::size_t c = 0; c < 3; ++c) {
      same = same && float_to_snorm8(static_cast<float>(direction[c] / size)) == bytes[c];
      EXPECT_NEAR(direction[c] / size, n[c] / length, 0.02);
    }
    exact += same ? 1 : 0;
  }
  EXPECT_GT(exact, 4700);
}

TEST(VertexStreams, TheMapRoundsAsThePackerDoes) {
  for (const int bits : {8, 9, 10}) {
    for (std::int32_t s = 0; s <= (1 << bits) - 2; s += 3) {
      for (std::int32_t t = 0; t <= (1 << bits) - 2; t += 5) {
        const auto d = octahedral_direction(s, t, bits);
        const auto bytes = snorm8_of_octahedral(s, t, bits);
        const double size = std::hypot(d[0], d[1], d[2]);
        for (std::size_t c = 0; c < 3; ++c) {
          // Ties aside, the very byte.
          EXPECT_LE(std::abs(float_to_snorm8(static_cast<float>(d[c] / size)) - bytes[c]), 1);
        }
      }
    }
  }
}

TEST(VertexStreams, RefusesWhatItCannotCarry) {
  AttributeRecord position{1, static_cast<std::uint8_t>(ComponentType::kHalf), 3, 0, 0, 0};
  EXPECT_TRUE(plan_streams(8, std::span(&position, 1)));
  EXPECT_FALSE(plan_streams(4, std::span(&position, 1))) << "it leaves the vertex";
  position.type = static_cast<std::uint8_t>(ComponentType::kF32);
  EXPECT_FALSE(plan_streams(16, std::span(&position, 1)));
  EXPECT_FALSE(plan_streams(8, {})) << "no position";
}

}  // namespace
}  // namespace modar
