// The quick looks at vertices and indices agree with a slow one over random bytes.
#include "formats/vertex_scan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

namespace {

using namespace modar;

/// binary16 by its definition, so that the expectation shares no code with the scan.
double half_value(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31;
  const int fraction = bits & 1023;
  const double sign = (bits & 0x8000) != 0 ? -1.0 : 1.0;
  if (exponent == 31) return fraction == 0 ? sign * INFINITY : NAN;
  return sign *
         (exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024 + fraction, exponent - 25));
}

AttributeRecord attribute(Semantic semantic, ComponentType type, std::uint8_t components,
                          std::uint16_t offset, std::uint8_t normalised) {
  return {static_cast<std::uint8_t>(semantic),
          static_cast<std::uint8_t>(type),
          components,
          normalised,
          offset,
          0};
}

/// Half positions, normals of 3 bytes, uvs and colours: `extra` more 4-byte attributes than a
/// normal.
LayoutRecord half_layout(std::uint16_t stride) {
  LayoutRecord layout{};
  layout.stride = stride;
  layout.attributes[layout.attribute_count++] =
      attribute(Semantic::kPosition, ComponentType::kHalf, 3, 0, 0);
  layout.attributes[layout.attribute_count++] =
      attribute(Semantic::kNormal, ComponentType::kI8, 3, 8, 1);
  if (stride > 12) {
    layout.attributes[layout.attribute_count++] =
        attribute(Semantic::kUv, ComponentType::kU16, 2, 12, 1);
  }
  if (stride > 16) {
    layout.attributes[layout.attribute_count++] = attribute(
        Semantic::kColour, ComponentType::kU8, 4, static_cast<std::uint16_t>(stride - 4), 1);
  }
  return layout;
}

using Vertices = std::vector<std::byte>;

std::uint16_t lane(const Vertices& bytes, std::size_t at) {
  std::uint16_t value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

void put(Vertices& bytes, std::size_t at, std::uint16_t value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// Finite positions, normals along one axis, zero padding.
Vertices good_vertices(std::uint16_t stride, std::size_t count, std::mt19937& random) {
  Vertices bytes(stride * count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto half = static_cast<std::uint16_t>(random() & 0xFFFF);
      put(bytes, i * stride + 2 * axis, (half & 0x7C00) == 0x7C00 ? 0 : half);
    }
    bytes[i * stride + 8 + i % 3] = std::byte{static_cast<unsigned char>(i % 2 == 0 ? 127 : 0x80)};
    for (std::size_t at = 12; at < stride; at += 2) {
      const bool used = at < 16 || at + 4 >= stride;
      put(bytes, i * stride + at, used ? static_cast<std::uint16_t>(random() & 0xFFFF) : 0);
    }
  }
  return bytes;
}

TEST(VertexScan, FindsTheExtentOfHalves) {
  std::mt19937 random(7);
  for (const std::uint16_t stride : std::initializer_list<std::uint16_t>{12, 16, 20, 32, 44, 64}) {
    const LayoutRecord layout = half_layout(stride);
    const VertexScan scan(layout);
    ASSERT_TRUE(scan.possible());
    for (const std::size_t count : {1u, 2u, 5u, 300u}) {
      const Vertices bytes = good_vertices(stride, count, random);
      double low[3] = {1e9, 1e9, 1e9};
      double high[3] = {-1e9, -1e9, -1e9};
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double value = half_value(lane(bytes, i * stride + 2 * axis));
          low[axis] = std::min(low[axis], value);
          high[axis] = std::max(high[axis], value);
        }
      }
      const VertexScan::Extent extent = scan.scan(bytes);
      EXPECT_TRUE(extent.finite && extent.unit_normals && extent.clean_padding) << stride;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(extent.low[axis], low[axis]) << stride << ", " << count;
        EXPECT_EQ(extent.high[axis], high[axis]) << stride << ", " << count;
      }
    }
  }
}

TEST(VertexScan, SeesOneBadVertexWhereverItStands) {
  std::mt19937 random(8);
  for (const std::uint16_t stride : std::initializer_list<std::uint16_t>{12, 16, 20, 44}) {
    const VertexScan scan(half_layout(stride));
    for (std::size_t bad = 0; bad < 9; ++bad) {
      const Vertices good = good_vertices(stride, 9, random);
      for (const std::uint16_t infinite :
           std::initializer_list<std::uint16_t>{0x7C00, 0xFC00, 0x7E01, 0xFFFF}) {
        Vertices bytes = good;
        put(bytes, bad * stride + 4, infinite);
        EXPECT_FALSE(scan.scan(bytes).finite);
      }
      Vertices bytes = good;
      bytes[bad * stride + 8 + bad % 3] = std::byte{100};
      EXPECT_FALSE(scan.scan(bytes).unit_normals);
      bytes = good;
      bytes[bad * stride + 11] = std::byte{1};  // behind the normal
      EXPECT_FALSE(scan.scan(bytes).clean_padding);
      bytes = good;
      bytes[bad * stride + 7] = std::byte{0x80};  // behind the position
      EXPECT_FALSE(scan.scan(bytes).clean_padding);
    }
  }
}

TEST(VertexScan, DecodesIntegersAsOpenGlDoes) {
  for (const auto& [type, least, most] :
       {std::tuple(ComponentType::kI16, -1.0, 1.0), std::tuple(ComponentType::kU16, 0.0, 1.0)}) {
    LayoutRecord layout{};
    layout.stride = 8;
    layout.attribute_count = 1;
    layout.attributes[0] = attribute(Semantic::kPosition, type, 4, 0, 1);
    Vertices bytes(16);
    const bool is_signed = type == ComponentType::kI16;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      put(bytes, 2 * axis, is_signed ? 0x8000 : 0);
      put(bytes, 8 + 2 * axis, is_signed ? 0x7FFF : 0xFFFF);
    }
    const VertexScan::Extent extent = VertexScan(layout).scan(bytes);
    EXPECT_EQ(extent.low[1], least);
    EXPECT_EQ(extent.high[2], most);
  }
}

TEST(VertexScan, LeavesFloatsToTheSlowLook) {
  LayoutRecord layout{};
  layout.stride = 12;
  layout.attribute_count = 1;
  layout.attributes[0] = attribute(Semantic::kPosition, ComponentType::kF32, 3, 0, 0);
  EXPECT_FALSE(VertexScan(layout).possible());
}

TEST(IndexScan, FindsTheGreatestAndEveryDegenerateTriangle) {
  std::mt19937 random(9);
  for (const std::size_t triangles : {1u, 8u, 9u, 33u, 100u}) {
    std::vector<std::uint16_t> good(3 * triangles);
    // Neighbours share vertices across triangles, never within one.
    for (std::size_t i = 0; i < good.size(); ++i) {
      good[i] = static_cast<std::uint16_t>((i / 3) % 2 == 0 ? i % 3 : 2 - i % 3);
    }
    EXPECT_FALSE(scan_indices(good).degenerate) << triangles;
    for (std::size_t t = 0; t < triangles; ++t) {
      const std::size_t from = 3 * t + random() % 3;
      const std::size_t to = 3 * t + (from - 3 * t + 1 + random() % 2) % 3;
      std::vector<std::uint16_t> bad = good;
      bad[to] = bad[from];
      EXPECT_TRUE(scan_indices(bad).degenerate) << t << " of " << triangles;
      bad = good;
      bad[from] = 40000;
      EXPECT_EQ(scan_indices(bad).greatest, 40000);
    }
  }
}

}  // namespace
