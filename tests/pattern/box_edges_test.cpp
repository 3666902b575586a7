// Crops of a box's sides, repaired by the print that runs over its edges.
#include <cstdlib>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/box_edges.hpp"
#include "tests/track/synthetic.hpp"

namespace modar {
namespace {

constexpr int kWide = 240;
constexpr int kDeep = 160;
constexpr int kHigh = 300;

GrayPicture picture_of(const cv::Mat& mat) {
  const cv::Mat whole = mat.clone();
  return {whole.cols, whole.rows, {whole.datastart, whole.dataend}};
}

/// Four sides cut from one strip of print; `off`: rows by which the right side's picture begins and
/// ends too low.
std::array<GrayPicture, 6> wrapped(int off) {
  const cv::Mat strip = test::textured_picture(2 * (kWide + kDeep), kHigh + 40, 51);
  std::array<GrayPicture, 6> sides;
  int left = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const int width = i % 2 == 0 ? kWide : kDeep;
    sides[i] = picture_of(strip(cv::Rect(left, 20 + (i == 1 ? off : 0), width, kHigh)));
    left += width;
  }
  return sides;
}

/// Mean difference of the front's last column from the right side's first.
double beside(const std::array<GrayPicture, 6>& sides) {
  double sum = 0;
  for (int y = 0; y < kHigh; ++y) {
    sum += std::abs(sides[0].pixels[static_cast<std::size_t>(y * kWide + kWide - 1)] -
                    sides[1].pixels[static_cast<std::size_t>(y * kDeep)]);
  }
  return sum / kHigh;
}

TEST(BoxEdges, PrintThatRunsAroundMeetsAgain) {
  const auto well = correct_crops(wrapped(0));
  EXPECT_EQ(well.most, 0);
  EXPECT_EQ(well.pictures[1].pixels, wrapped(0)[1].pixels) << "nothing is touched";
  const auto cut = wrapped(8);
  const auto corrected = correct_crops(cut);
  EXPECT_FALSE(corrected.beyond);
  // 8 of 300 rows between the right side and its neighbours, which share them.
  EXPECT_GT(corrected.most, 0.4 * 8 / 300);
  EXPECT_LT(corrected.most, 0.8 * 8 / 300);
  EXPECT_LT(beside(corrected.pictures), 0.5 * beside(cut));
}

TEST(BoxEdges, SidesThatHaveNothingInCommonStay) {
  for (std::uint32_t seed = 100; seed < 200; seed += 10) {
    std::array<GrayPicture, 6> sides;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const int width = i == 1 || i == 3 ? kDeep : kWide;
      sides[i] = picture_of(test::textured_picture(width, i < 4 ? kHigh : kDeep,
                                                   seed + static_cast<std::uint32_t>(i)));
    }
    EXPECT_EQ(correct_crops(sides).most, 0) << seed;
  }
}

}  // namespace
}  // namespace modar
