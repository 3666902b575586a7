// Lines on pictures, held against the distance to the segment computed pixel by pixel.
#include "runtime/play/overlay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace modar {
namespace {

constexpr int kSheetWidth = 50;
constexpr int kSheetHeight = 40;

struct Paper {
  std::vector<std::uint8_t> rgba = std::vector<std::uint8_t>(kSheetWidth * kSheetHeight * 4, 0);
  Canvas canvas{rgba, kSheetWidth, kSheetHeight};
  [[nodiscard]] int red(int x, int y) const {
    return rgba[static_cast<std::size_t>((y * kSheetWidth + x) * 4)];
  }
};

double distance(double x, double y, glm::dvec2 a, glm::dvec2 b) {
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const double t =
      std::fmin(1, std::fmax(0, ((x - a.x) * dx + (y - a.y) * dy) / (dx * dx + dy * dy)));
  return std::hypot(x - a.x - t * dx, y - a.y - t * dy);
}

TEST(Overlay, ALineCoversItsWidthAndNothingElse) {
  const std::pair<glm::dvec2, glm::dvec2> segments[] = {
      {{5, 5}, {40, 30}}, {{10, 35}, {12, 3}}, {{5.5, 20.25}, {44.5, 20.75}}, {{25, 2}, {25, 38}}};
  for (const auto& [from, to] : segments) {
    Paper paper;
    draw_line(paper.canvas, from, to, 3, {255, 0, 0});
    for (int y = 0; y < kSheetHeight; ++y) {
      for (int x = 0; x < kSheetWidth; ++x) {
        const double away = distance(x, y, from, to);
        if (away < 0.99) {
          ASSERT_EQ(paper.red(x, y), 255) << x << ' ' << y;
        }
        if (away > 2.01) {
          ASSERT_EQ(paper.red(x, y), 0) << x << ' ' << y;
        }
      }
    }
  }
}

TEST(Overlay, ALineThatLeavesThePictureIsClipped) {
  Paper paper;
  draw_line(paper.canvas, {-1e7, 20}, {1e7, 20}, 1, {255, 0, 0});
  for (int x = 0; x < kSheetWidth; ++x) EXPECT_EQ(paper.red(x, 20), 255);
  EXPECT_EQ(paper.red(0, 22), 0);
  draw_line(paper.canvas, {-5, -5}, {-5, 500}, 1, {255, 0, 0});
  draw_line(paper.canvas, {NAN, 0}, {3, 3}, 1, {255, 0, 0});
  EXPECT_EQ(paper.red(0, 0), 0);
}

TEST(Overlay, AnOutlineClosesAndLeavesAlphaAlone) {
  Paper paper;
  draw_outline(paper.canvas, {{{10, 10}, {40, 10}, {40, 30}, {10, 30}}}, {250, 0, 0});
  for (const auto& [x, y] : {std::pair{25, 10}, {40, 20}, {25, 30}, {10, 20}}) {
    EXPECT_GT(paper.red(x, y), 240) << x << ' ' << y;
  }
  EXPECT_EQ(paper.red(25, 20), 0);
  for (std::size_t i = 3; i < paper.rgba.size(); i += 4) ASSERT_EQ(paper.rgba[i], 0);
}

}  // namespace
}  // namespace modar
