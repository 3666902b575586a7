// Points of curved and boxed patterns against closed forms by the library's sines.
#include "formats/pattern_shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

namespace {

using namespace modar;

double length(const std::array<double, 3>& v) {
  return std::hypot(v[0], v[1], v[2]);
}

TEST(PatternShape, RoundPointsAreThoseOfTheSpecification) {
  constexpr int kWidth = 640;
  constexpr int kHeight = 480;
  for (const double half_arc : {0.01, 1.047, std::numbers::pi}) {
    for (const double slope : {0.0, 0.3, -0.2}) {
      const auto surface = PatternSurface::round(kWidth, kHeight, half_arc, slope);
      const double radius = 1 / half_arc;
      EXPECT_DOUBLE_EQ(surface.radius(), radius);
      for (double x = -0.5; x <= kWidth; x += 29.0625) {
        for (double y = -0.5; y <= kHeight; y += 43.75) {
          const SurfacePoint point = surface.at(x, y);
          const double angle = (x + 0.5 - kWidth / 2.0) / (kWidth / 2.0) * half_arc;
          const double up = (kHeight / 2.0 - y - 0.5) / (kWidth / 2.0);
          const double r = radius + slope * up;
          EXPECT_NEAR(point.at[0], r * std::sin(angle), 1e-13 * radius);
          EXPECT_NEAR(point.at[1], std::sqrt(1 - slope * slope) * up, 1e-14);
          EXPECT_NEAR(point.at[2], r * std::cos(angle) - radius, 1e-13 * radius);
          // Not stretched along the axis' direction; the derivatives by differences.
          EXPECT_NEAR(length(point.down), 2.0 / kWidth, 1e-15);
          constexpr double kStep = 1e-3;
          for (std::size_t i = 0; i < 3; ++i) {
            const double across = surface.at(x + kStep, y).at[i] - surface.at(x - kStep, y).at[i];
            const double along = surface.at(x, y + kStep).at[i] - surface.at(x, y - kStep).at[i];
            EXPECT_NEAR(point.right[i], across / (2 * kStep), 1e-9);
            EXPECT_NEAR(point.down[i], along / (2 * kStep), 1e-9);
            const double turned =
                surface.at(x + kStep, y).right[i] - surface.at(x - kStep, y).right[i];
            EXPECT_NEAR(point.bend[i], turned / (2 * kStep), 1e-9);
          }
        }
      }
    }
  }
  const PatternSurface flat;
  EXPECT_TRUE(flat.flat());
}

TEST(PatternShape, FacesLieWhereTheyAreStated) {
  const ShapeFaceRecord faces[] = {{{0, 0, 100, 50}, {-1, 0.5f, 0}, {2, 0, 0}, {0, -1, 0}, 0},
                                   {{0, 50, 40, 50}, {1, 0.5f, 0}, {0, 0, -0.8f}, {0, -1, 0}, 0}};
  const auto surface = PatternSurface::of_faces(100, 100, faces);
  EXPECT_EQ(surface.at(49.5, 24.5).at, (std::array<double, 3>{0, 0, 0}));
  EXPECT_EQ(surface.at(99.5, -0.5).at, (std::array<double, 3>{1, 0.5, 0}));
  const SurfacePoint side = surface.at(19.5, 74.5);
  EXPECT_NEAR(side.at[0], 1, 1e-12);
  EXPECT_NEAR(side.at[1], 0, 1e-12);
  EXPECT_NEAR(side.at[2], -0.4, 1e-7);
  EXPECT_NEAR(side.right[2], -0.02, 1e-9);
  // Next to all of them: the nearest one continues.
  EXPECT_NEAR(surface.at(59.5, 90).at[2], -1.2, 1e-6);
}

std::vector<std::byte> section_of(const PatternShapeHeader& header,
                                  std::vector<ShapeFaceRecord> faces = {}) {
  std::vector<std::byte> bytes(sizeof header + faces.size() * sizeof(ShapeFaceRecord));
  std::memcpy(bytes.data(), &header, sizeof header);
  if (!faces.empty()) {
    std::memcpy(bytes.data() + sizeof header, faces.data(), bytes.size() - sizeof header);
  }
  return bytes;
}

TEST(PatternShape, RulesOfTheSection) {
  PatternSurface surface;
  const auto fault = [&](const PatternShapeHeader& header,
                         const std::vector<ShapeFaceRecord>& faces = {}) {
    const char* cause = view_pattern_shape(section_of(header, faces), 200, 100, surface);
    return std::string(cause != nullptr ? cause : "");
  };
  EXPECT_EQ(fault({1, 0, 1.5, 0.25, {}}), "");
  EXPECT_NEAR(surface.radius(), 1 / 1.5, 1e-15);
  EXPECT_NE(fault({1, 0, 0, 0, {}}), "");
  EXPECT_NE(fault({1, 0, 3.1416, 0, {}}), "");
  EXPECT_NE(fault({1, 0, std::nan(""), 0, {}}), "");
  EXPECT_NE(fault({1, 0, 1.5, std::nan(""), {}}), "");
  EXPECT_NE(fault({1, 0, 3.1, 0.7, {}}), "");  // no radius left at one end
  EXPECT_NE(fault({1, 0, 0.1, 1, {}}), "");
  EXPECT_NE(fault({3, 0, 1, 0, {}}), "");
  EXPECT_NE(fault({2, 0, 0, 0, {}}), "");
  const ShapeFaceRecord good{{0, 0, 200, 100}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0};
  EXPECT_EQ(fault({2, 1, 0, 0, {}}, {good}), "");
  EXPECT_NE(fault({2, 1, 1, 0, {}}, {good}), "");
  EXPECT_NE(fault({2, 2, 0, 0, {}}, {good}), "");
  EXPECT_NE(fault({1, 1, 1, 0, {}}, {good}), "");
  for (int k = 0; k < 4; ++k) {
    ShapeFaceRecord bad = good;
    if (k == 0) bad.place[2] = 201;
    if (k == 1) bad.place[3] = 0;
    if (k == 2) bad.right[1] = 0.01f;
    if (k == 3) bad.corner[0] = std::nanf("");
    EXPECT_NE(fault({2, 1, 0, 0, {}}, {bad}), "") << k;
  }
  PatternSurface cut;
  EXPECT_NE(view_pattern_shape({}, 200, 100, cut), nullptr);
}

}  // namespace
