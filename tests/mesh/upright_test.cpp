// Which way is up: shapes whose answer anyone sees.
#include "bake/mesh/upright.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>

#include "bake/import/up_comment.hpp"
#include "tests/mesh/stages.hpp"

namespace modar {
namespace {

using Put = std::function<std::string(double, double, double)>;

std::string vertex(double x, double y, double z) {
  char line[96];
  std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", x, y, z);
  return line;
}
std::string z_up(double x, double y, double z) {
  return vertex(x, y, z);
}
std::string y_up(double x, double y, double z) {
  return vertex(x, z, -y);
}

/// A closed vase: rings of 24 around the vertical axis, whose radii belong to heights 0 to 1.
std::string turned(const std::vector<double>& radii, double height, const Put& place) {
  constexpr int kRound = 24;
  std::string text;
  const int rings = static_cast<int>(radii.size());
  for (int r = 0; r < rings; ++r) {
    for (int i = 0; i < kRound; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRound;
      const double radius = radii[static_cast<std::size_t>(r)];
      text += place(radius * std::cos(angle), radius * std::sin(angle), height * r / (rings - 1));
    }
  }
  for (int r = 0; r + 1 < rings; ++r) {
    for (int i = 0; i < kRound; ++i) {
      const int a = r * kRound + i + 1;
      const int b = r * kRound + (i + 1) % kRound + 1;
      text += "f " + std::to_string(a) + " " + std::to_string(b) + " " +
              std::to_string(b + kRound) + " " + std::to_string(a + kRound) + "\n";
    }
  }
  std::string bottom = "f";
  std::string top = "f";
  for (int i = 0; i < kRound; ++i) {
    bottom += " " + std::to_string(kRound - i);
    top += " " + std::to_string((rings - 1) * kRound + i + 1);
  }
  return text + bottom + "\n" + top + "\n";
}

/// Open ground with a few hills.
std::string ground(const Put& place) {
  constexpr int kSide = 12;
  std::string text;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) text += place(i, j, std::sin(0.9 * i) * std::cos(0.7 * j));
  }
  for (int j = 0; j + 1 < kSide; ++j) {
    for (int i = 0; i + 1 < kSide; ++i) {
      const int a = j * kSide + i + 1;
      text += "f " + std::to_string(a) + " " + std::to_string(a + 1) + " " +
              std::to_string(a + kSide + 1) + " " + std::to_string(a + kSide) + "\n";
    }
  }
  return text;
}

Upright up_of(const std::string& obj) {
  return find_up(testing::welded(testing::parse(obj)));
}

void expect_up(const Upright& found, UpAxis axis, UpReason reason, const char* what) {
  EXPECT_EQ(found.axis, axis) << what;
  EXPECT_EQ(found.reason, reason) << what;
}

TEST(Up, OfAStatueOnItsBase) {
  const std::vector<double> statue = {0.5, 0.45, 0.3, 0.25, 0.2, 0.05};
  expect_up(up_of(turned(statue, 3, z_up)), UpAxis::kZ, UpReason::kBase, "z");
  expect_up(up_of(turned(statue, 3, y_up)), UpAxis::kY, UpReason::kConvention, "y");
}

TEST(Up, OfWhatCouldStandEitherWayIsTheConvention) {
  // A column is as wide at its top; a dish is wider than high.
  expect_up(up_of(turned({0.5, 0.5, 0.5}, 3, z_up)), UpAxis::kY, UpReason::kConvention, "column");
  expect_up(up_of(turned({0.5, 0.4, 0.2}, 0.3, z_up)), UpAxis::kY, UpReason::kConvention, "dish");
}

TEST(Up, OfOpenGround) {
  expect_up(up_of(ground(z_up)), UpAxis::kZ, UpReason::kGround, "z");
  expect_up(up_of(ground(y_up)), UpAxis::kY, UpReason::kConvention, "y");
}

TEST(Up, OfMapCoordinates) {
  const auto far = [](const Put& place) -> Put {
    return [place](double x, double y, double z) {
      return place(x + 349012.25, y + 6648377.5, z + 111.75);
    };
  };
  const std::vector<double> shapeless = {0.3, 0.5, 0.3};
  expect_up(up_of(turned(shapeless, 1, far(z_up))), UpAxis::kZ, UpReason::kGeoreferenced, "z");
  expect_up(up_of(turned(shapeless, 1, far(y_up))), UpAxis::kY, UpReason::kGeoreferenced, "y");
}

TEST(Up, OfAHeaderIsBelieved) {
  const std::vector<double> statue = {0.5, 0.45, 0.3, 0.25, 0.2, 0.05};
  expect_up(up_of("# Unit: metres, Y up.\n" + turned(statue, 3, z_up)), UpAxis::kY,
            UpReason::kHeader, "header");
}

TEST(Up, InComments) {
  const auto axis = [](const char* text) { return up_in_comments(text); };
  EXPECT_EQ(axis("# Unit: metres, Z up. CC0.\n"), UpAxis::kZ);
  EXPECT_EQ(axis("# exported Y-UP\nv 0 0 0\n"), UpAxis::kY);
  EXPECT_EQ(axis("#up axis: -z\r\n"), UpAxis::kMinusZ);
  EXPECT_EQ(axis("ply\ncomment Up = +Y\n"), UpAxis::kY);
  EXPECT_EQ(axis("# up-axis is x\n"), UpAxis::kX);
  EXPECT_FALSE(axis("# Blender v2.79 OBJ File: 'up.blend'\n"));
  EXPECT_FALSE(axis("# z up\n# y up\n"));
  EXPECT_FALSE(axis("v 1 2 3\no z up\n"));
  EXPECT_FALSE(axis("# axis z\n# upper z\n"));
}

}  // namespace
}  // namespace modar
