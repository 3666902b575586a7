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
