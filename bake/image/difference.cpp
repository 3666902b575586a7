// How far a decoded texture is from its source: PSNR and SSIM.
#include "bake/image/difference.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace modar {
namespace {

constexpr int kRadius = 5;

/// Gaussian of sigma 1.5 over 11 samples, its sum 1, as the article on SSIM has it.
constexpr std::array<double, 2 * kRadius + 1> kWindow = {
    0.00102838, 0.00759876, 0.03600077, 0.10936069, 0.21300554, 0.26601172,
    0.21300554, 0.10936069, 0.03600077, 0.00759876, 0.00102838};

constexpr std::size_t kTaps = kWindow.size();

/// Sums over a window: of a, b, a * a, b * b and a * b.
using Moments = std::array<double, 5>;

/// BT.601 luma, 0-255.
double luma(const RgbaImage& image, std::size_t pixel) {
  const std::uint8_t* p = &image.pixels[pixel * 4];
  return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
}

double similarity(const Moments& m) {
  constexpr double kC1 = 0.01 * 255 * 0.01 * 255;
  constexpr double kC2 = 0.03 * 255 * 0.03 * 255;
  const auto [mean_a, mean_b, square_a, square_b, product] = m;
  const double variance_a = square_a - mean_a * mean_a;
  const double variance_b = square_b - mean_b * mean_b;
  const double covariance = product - mean_a * mean_b;
  return (2 * mean_a * mean_b + kC1) * (2 * covariance + kC2) /
         ((mean_a * mean_a + mean_b * mean_b + kC1) * (variance_a + variance_b + kC2));
}

/// The moments of a row's pixels, one by one.
void pixel_moments(const RgbaImage& a, const RgbaImage& b, std::size_t row,
                   std::vector<Moments>& moments) {
  for (std::size_t x = 0; x < a.width; ++x) {
    const double p = luma(a, row * a.width + x);
    const double q = luma(b, row * a.width + x);
    moments[x] = {p, q, p * p, q * q, p * q};
  }
}

/// Adds `count` moments, weighted, to as many.
void add_weighted(const Moments* from, double weight, std::size_t count, Moments* to) {
  const double* numbers = from->data();
  double* sums = to->data();
  for (std::size_t i = 0; i < 5 * count; ++i) sums[i] += weight * numbers[i];
}

double psnr_of(std::uint64_t sum_of_squares, std::uint64_t samples) {
  if (sum_of_squares == 0) return kEqualPsnr;
  const double mean = static_cast<double>(sum_of_squares) / static_cast<double>(samples);
  return std::min(kEqualPsnr, 10 * std::log10(255.0 * 255.0 / mean));
}

/// Sum over red, green and blue.
std::uint64_t square_error(const RgbaImage& a, const RgbaImage& b, std::size_t pixel) {
  std::uint64_t sum = 0;
  for (std::size_t i = pixel * 4; i < pixel * 4 + 3; ++i) {
    const int d = int{a.pixels[i]} - int{b.pixels[i]};
    sum += static_cast<std::uint64_t>(d * d);
  }
  return sum;
}

std::size_t clamped(std::int64_t value, std::uint32_t size) {
  return static_cast<std::size_t>(std::clamp<std::int64_t>(value, 0, std::int64_t{size} - 1));
}

}  // namespace

double psnr_db(const RgbaImage& a, const RgbaImage& b) {
  const std::size_t pixels = std::min(a.pixels.size(), b.pixels.size()) / 4;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < pixels; ++i) sum += square_error(a, b, i);
  return psnr_of(sum, pixels * 3);
}

WorstBlock worst_block(const RgbaImage& a, const RgbaImage& b) {
  WorstBlock worst;
  for (std::uint32_t top = 0; top < a.height; top += 4) {
    for (std::uint32_t left = 0; left < a.width; left += 4) {
      std::uint64_t sum = 0;
      std::uint64_t pixels = 0;
      for (std::uint32_t y = top; y < std::min(top + 4, a.height); ++y) {
        for (std::uint32_t x = left; x < std::min(left + 4, a.width); ++x, ++pixels) {
          sum += square_error(a, b, std::size_t{y} * a.width + x);
        }
      }
      const double db = psnr_of(sum, pixels * 3);
      if (db < worst.psnr_db) worst = {left, top, db};
    }
  }
  return worst;
}

RgbaImage quality_picture(const RgbaImage& source, const RgbaImage& decoded) {
  constexpr int kGain = 8;
  const std::size_t width = source.width;
  RgbaImage picture{source.width * 3, source.height, {}};
  picture.pixels.assign(width * 3 * source.height * 4, 255);
  for (std::size_t i = 0; i < width * source.height; ++i) {
    std::uint8_t* out = &picture.pixels[(i / width * width * 3 + i % width) * 4];
    for (std::size_t c = 0; c < 3; ++c) {
      const int before = source.pixels[4 * i + c];
      const int after = decoded.pixels[4 * i + c];
      out[c] = static_cast<std::uint8_t>(before);
      out[width * 4 + c] = static_cast<std::uint8_t>(after);
      out[width * 8 + c] =
          static_cast<std::uint8_t>(std::min(255, kGain * std::abs(before - after)));
    }
  }
  return picture;
}

double ssim(const RgbaImage& a, const RgbaImage& b) {
  if (a.width != b.width || a.height != b.height || a.pixels.empty()) return 0;
  const std::size_t width = a.width;
  std::array<std::vector<Moments>, kTaps> rows;  // by row, modulo their number
  rows.fill(std::vector<Moments>(width));
  std::vector<Moments> column(width + 2 * kRadius);  // the edges' columns repeated
  std::vector<Moments> window(width);
  double sum = 0;
  std::size_t next = 0;  // row whose moments are not there
  for (std::int64_t y = 0; y < a.height; ++y) {
    for (; next <= clamped(y + kRadius, a.height); ++next) {
      pixel_moments(a, b, next, rows[next % kTaps]);
    }
    std::fill(column.begin(), column.end(), Moments{});
    std::fill(window.begin(), window.end(), Moments{});
    for (std::size_t k = 0; k < kTaps; ++k) {
      const auto row = clamped(y + static_cast<int>(k) - kRadius, a.height);
      add_weighted(rows[row % kTaps].data(), kWindow[k], width, &column[kRadius]);
    }
    std::fill_n(column.begin(), kRadius, column[kRadius]);
    std::fill_n(column.end() - kRadius, kRadius, column[width + kRadius - 1]);
    for (std::size_t k = 0; k < kTaps; ++k) {
      add_weighted(&column[k], kWindow[k], width, window.data());
    }
    for (const Moments& moments : window) sum += similarity(moments);
  }
  return sum / (static_cast<double>(width) * a.height);
}

}  // namespace modar
