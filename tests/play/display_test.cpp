// What the on-screen display says, and that it is painted.
#include "runtime/play/overlay.hpp"

#include <gtest/gtest.h>

namespace modar {
namespace {

TEST(Display, SaysStateReasonAndInliers) {
  const std::vector<std::string> names = {"box"};
  FrameReport report;
  report.frame = 41;
  report.reason = Reason::kFewMatches;
  EXPECT_EQ(display_text(report, names, 0), "41  hidden: few matches");
  report.state = Shown::kHeld;
  EXPECT_EQ(display_text(report, names, 29.96), "41  30.0 fps  held: few matches");
  report.reason = Reason::kVisible;
  report.state = Shown::kShown;
  report.visible.resize(1);
  report.visible[0].inliers = 57;
  EXPECT_EQ(display_text(report, names, 0), "41  shown  box 57 inliers");
  report.state = Shown::kHidden;
  EXPECT_EQ(display_text(report, names, 0), "41  hidden: seen once  box 57 inliers");
}

TEST(Display, MeasuresPicturesASecond) {
  RateMeter meter;
  EXPECT_EQ(meter.rate(), 0);
  for (std::int64_t i = 1; i <= 60; ++i) meter.add(i * 25'000'000);
  EXPECT_NEAR(meter.rate(), 40, 1e-9);
}

TEST(Display, PaintsABarWithLettersAlongTheTopOnly) {
  constexpr int kW = 400;
  constexpr int kH = 120;
  std::vector<std::uint8_t> rgba(kW * kH * 4, 200);
  ASSERT_TRUE(draw_text_bar({rgba, kW, kH}, "12  shown"));
  int bright = 0;
  int dark = 0;
  for (int y = 0; y < kH; ++y) {
    for (int x = 0; x < kW; ++x) {
      const std::uint8_t red = rgba[static_cast<std::size_t>(4 * (y * kW + x))];
      if (y > 30) {
        ASSERT_EQ(red, 200) << x << ' ' << y;
      }
      bright += red > 230 ? 1 : 0;
      dark += red < 90 ? 1 : 0;
    }
  }
  EXPECT_GT(bright, 20);
  EXPECT_GT(dark, 3000);
  std::vector<std::uint8_t> tiny(4, 0);
  EXPECT_TRUE(draw_text_bar({tiny, 1, 1}, "x"));
}

}  // namespace
}  // namespace modar
