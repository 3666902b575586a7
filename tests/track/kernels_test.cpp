// Every SIMD level of the loop's kernels against plain loops written here.
#include "runtime/track/kernels.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "synthetic.hpp"

namespace modar::tracker {
namespace {

std::vector<std::uint8_t> noise(std::size_t count, std::uint32_t seed) {
  std::vector<std::uint8_t> bytes(count);
  cv::RNG random(seed);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.uniform(0, 256));
  return bytes;
}

TEST(Kernels, ThisProcessorHasAtLeastTheBaseline) {
  ASSERT_FALSE(all_kernels().empty());
  EXPECT_STREQ(kernels().name, all_kernels().back().name);
}

TEST(Kernels, HalvesRowsOfAnyLength) {
  for (const Kernels& run : all_kernels()) {
    for (int count = 0; count < 70; ++count) {
      // Exactly as long as the kernel may read: the sanitizer watches the ends.
      const auto top = noise(static_cast<std::size_t>(2 * count), 1);
      const auto bottom = noise(static_cast<std::size_t>(2 * count), 2);
      std::vector<std::uint8_t> out(static_cast<std::size_t>(count));
      run.halve_row(top.data(), bottom.data(), out.data(), count);
      for (std::size_t i = 0; i < out.size(); ++i) {
        const double mean = (top[2 * i] + top[2 * i + 1] + bottom[2 * i] + bottom[2 * i + 1]) / 4.0;
        ASSERT_EQ(out[i], static_cast<int>(mean + 0.5)) << run.name << " " << count << " " << i;
      }
    }
  }
}

TEST(Kernels, BlursAsOpenCvsBinomialFilter) {
  const int width = 83;
  cv::Mat image(5, width, CV_8UC1);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 256);
  const cv::Mat binomial = (cv::Mat_<double>(1, 5) << 1, 4, 6, 4, 1) / 16.0;
  cv::Mat expected;
  cv::sepFilter2D(image, expected, CV_64F, binomial, binomial);
  for (const Kernels& run : all_kernels()) {
    const std::uint8_t* rows[5];
    for (int y = 0; y < 5; ++y) rows[y] = image.ptr(y);
    std::vector<std::uint16_t> sums(width + 3 * kSlack);
    std::vector<std::uint8_t> out(width + kSlack);
    run.blur_columns(rows, sums.data() + kSlack, width);
    run.blur_row(sums.data() + kSlack, out.data(), width);
    for (int x = 2; x < width - 2; ++x) {
      ASSERT_NEAR(out[static_cast<std::size_t>(x)], expected.at<double>(2, x), 0.5 + 1e-9)
          << run.name;
    }
  }
}

TEST(Kernels, FindsTheCornersThatOpenCvFinds) {
  const cv::Mat image = test::textured_picture(200, 150, 8);
  const int threshold = 17;
  std::vector<cv::KeyPoint> expected;
  cv::FAST(image, expected, threshold, false, cv::FastFeatureDetector::TYPE_9_16);
  cv::Mat scores(image.size(), CV_8UC1, cv::Scalar(0));
  for (const cv::KeyPoint& point : expected) {
    scores.at<std::uint8_t>(static_cast<int>(point.pt.y), static_cast<int>(point.pt.x)) = 1;
  }
  for (const Kernels& run : all_kernels()) {
    std::vector<std::uint8_t> bright(200 + kSlack);
    std::vector<std::uint8_t> score(200 + kSlack);
    for (int y = 3; y < 140; ++y) {
      run.corner_scores(image.ptr(y) + 3, static_cast<std::ptrdiff_t>(image.step[0]), threshold + 1,
                        194, bright.data(), score.data());
      for (int x = 3; x < 197; ++x) {
        const int ours = score[static_cast<std::size_t>(x - 3)];
        ASSERT_EQ(ours > 0, scores.at<std::uint8_t>(y, x) > 0) << run.name << " " << x << " " << y;
        if (ours > 0) {
          ASSERT_GT(ours, threshold);
        }
      }
    }
  }
}

TEST(Kernels, KeepsTheFirstOfEqualPeaks) {
  for (const Kernels& run : all_kernels()) {
    std::vector<std::uint8_t> rows(3 * 200, 0);
    std::uint8_t* middle = rows.data() + 264;
    middle[10] = 50;
    middle[11] = 50;
    middle[20] = 40;
    rows[64 + 21] = 41;  // above
    middle[30] = 9;
    std::vector<std::uint8_t> peak(64 + kSlack);
    run.peaks(rows.data() + 64, middle, rows.data() + 464, 64, peak.data());
    EXPECT_EQ(peak[10], 50) << run.name;
    EXPECT_EQ(peak[11], 0);
    EXPECT_EQ(peak[20], 0);
    EXPECT_EQ(peak[30], 9);
    EXPECT_EQ(std::count_if(peak.begin(), peak.begin() + 64, [](int p) { return p > 0; }), 2);
  }
}

TEST(Kernels, CountsDifferingBitsAndSkipsWhatIsFar) {
  const std::size_t blocks = 3;
  auto bytes = noise(blocks * kBlockCodes * kCodeBytes, 5);
  const auto code = noise(kCodeBytes, 6);
  // One code of the middle block differs in 11 bits only.
  for (int k = 0; k < kCodeBytes; ++k) {
    bytes[(1 * kCodeBytes + static_cast<std::size_t>(k)) * kBlockCodes + 7] =
        static_cast<std::uint8_t>(code[static_cast<std::size_t>(k)] ^ (k < 11 ? 1 : 0));
  }
  for (const Kernels& run : all_kernels()) {
    std::vector<std::uint8_t> all(blocks * kBlockCodes);
    EXPECT_EQ(run.distances(code.data(), bytes.data(), blocks, 255, all.data()), 11);
    for (std::size_t i = 0; i < all.size(); ++i) {
      int bits = 0;
      for (std::size_t k = 0; k < kCodeBytes; ++k) {
        const std::uint8_t byte =
            bytes[(i / kBlockCodes * kCodeBytes + k) * kBlockCodes + i % kBlockCodes];
        bits += std::popcount(static_cast<unsigned>(byte ^ code[k]));
      }
      ASSERT_EQ(all[i], std::min(bits, 255)) << run.name;
    }
    std::vector<std::uint8_t> near(blocks * kBlockCodes);
    EXPECT_EQ(run.distances(code.data(), bytes.data(), blocks, 20, near.data()), 11);
    EXPECT_EQ(near[kBlockCodes + 7], 11);
    EXPECT_EQ(near[0], 255);
  }
}

TEST(Kernels, AllLevelsGiveTheSameBits) {
  const auto levels = all_kernels();
  const cv::Mat image = test::textured_picture(300, 60, 9);
  std::vector<std::vector<std::uint8_t>> answers;
  for (const Kernels& run : levels) {
    std::vector<std::uint8_t> answer;
    for (int y = 3; y < 50; ++y) {
      std::vector<std::uint8_t> bright(294 + kSlack);
      std::vector<std::uint8_t> score(294 + kSlack);
      run.corner_scores(image.ptr(y) + 3, static_cast<std::ptrdiff_t>(image.step[0]), 12, 294,
                        bright.data(), score.data());
      answer.insert(answer.end(), bright.begin(), bright.begin() + 294);
      answer.insert(answer.end(), score.begin(), score.begin() + 294);
    }
    answers.push_back(std::move(answer));
  }
  for (const auto& answer : answers) EXPECT_EQ(answer, answers.front());
}

}  // namespace
}  // namespace modar::tracker
