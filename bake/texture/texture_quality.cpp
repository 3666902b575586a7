// How far a decoded texture is from its source: PSNR and SSIM.
#include "bake/texture/texture_quality.hpp"

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

struct Moments {
  double mean_a = 0;
  double mean_b = 0;
  double square_a = 0;
  double square_b = 0;
  double product = 0;

  void add(double weight, const Moments& m) {
    mean_a += weight * m.mean_a;
    mean_b += weight * m.mean_b;
    square_a += weight * m.square_a;
    square_b += weight * m.square_b;
    product += weight * m.product;
  }
};

/// BT.601 luma, 0-255.
double luma(const RgbaImage& image, std::size_t pixel) {
  const std::uint8_t* p = &image.pixels[pixel * 4];
  return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
}

double similarity(const Moments& m) {
  constexpr double kC1 = 0.01 * 255 * 0.01 * 255;
  constexpr double kC2 = 0.03 * 255 * 0.03 * 255;
  const double variance_a = m.square_a - m.mean_a * m.mean_a;
  const double variance_b = m.square_b - m.mean_b * m.mean_b;
  const double covariance = m.product - m.mean_a * m.mean_b;
  return (2 * m.mean_a * m.mean_b + kC1) * (2 * covariance + kC2) /
         ((m.mean_a * m.mean_a + m.mean_b * m.mean_b + kC1) * (variance_a + variance_b + kC2));
}

std::size_t clamped(std::int64_t value, std::uint32_t size) {
  return static_cast<std::size_t>(std::clamp<std::int64_t>(value, 0, std::int64_t{size} - 1));
}

}  // namespace

double psnr_db(const RgbaImage& a, const RgbaImage& b) {
  const std::size_t pixels = std::min(a.pixels.size(), b.pixels.size()) / 4;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < pixels * 4; ++i) {
    if (i % 4 == 3) continue;
    const int d = int{a.pixels[i]} - int{b.pixels[i]};
    sum += static_cast<std::uint64_t>(d * d);
  }
  if (sum == 0) return kEqualPsnr;
  const double mean = static_cast<double>(sum) / (static_cast<double>(pixels) * 3);
  return std::min(kEqualPsnr, 10 * std::log10(255.0 * 255.0 / mean));
}

double ssim(const RgbaImage& a, const RgbaImage& b) {
  if (a.width != b.width || a.height != b.height || a.pixels.empty()) return 0;
  const std::uint32_t width = a.width;
  const std::uint32_t height = a.height;
  std::vector<Moments> column(width);
  double sum = 0;
  for (std::uint32_t y = 0; y < height; ++y) {
    std::fill(column.begin(), column.end(), Moments{});
    for (int k = -kRadius; k <= kRadius; ++k) {
      const std::size_t row = clamped(std::int64_t{y} + k, height) * width;
      const double weight = kWindow[static_cast<std::size_t>(k + kRadius)];
      for (std::size_t x = 0; x < width; ++x) {
        const double p = luma(a, row + x);
        const double q = luma(b, row + x);
        column[x].add(weight, {p, q, p * p, q * q, p * q});
      }
    }
    for (std::uint32_t x = 0; x < width; ++x) {
      Moments m;
      for (int k = -kRadius; k <= kRadius; ++k) {
        m.add(kWindow[static_cast<std::size_t>(k + kRadius)],
              column[clamped(std::int64_t{x} + k, width)]);
      }
      sum += similarity(m);
    }
  }
  return sum / (static_cast<double>(width) * height);
}

}  // namespace modar
