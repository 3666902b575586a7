// The photometric check of a place.
#include <algorithm>
#include <array>
#include <cmath>

#include "bilinear.hpp"
#include "plane_align.hpp"

namespace modar::tracker {
namespace {

float correlation(std::span<const float> a, std::span<const float> b, float& contrast) {
  float sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sa += a[i];
    sb += b[i];
    saa += a[i] * a[i];
    sbb += b[i] * b[i];
    sab += a[i] * b[i];
  }
  const float n = static_cast<float>(a.size());
  const float va = saa / n - sa / n * sa / n;
  const float vb = sbb / n - sb / n * sb / n;
  contrast = va;
  if (!(va > 0.0f) || !(vb > 0.25f)) return 0.0f;
  return (sab / n - sa / n * sb / n) / std::sqrt(va * vb);
}

}  // namespace

Verdict verify(const TrackedPattern& pattern, const PlaneMap& map,
               std::span<const GrayImage> pyramid) {
  constexpr int kCells = 8;
  constexpr int kSide = 6;
  constexpr float kTextured = 16.0f;
  constexpr float kRight = 0.5f;
  const glm::dmat2 d = map.derivative({0.5 * pattern.width(), 0.5 * pattern.height()});
  const double step =
      std::max(pattern.width(), pattern.height()) / static_cast<double>(kCells * kSide);
  const double scale = std::sqrt(std::abs(d[0].x * d[1].y - d[0].y * d[1].x));
  const auto level_of = [](double pixels, int count) {
    return std::clamp(static_cast<int>(std::lround(std::log2(std::max(pixels, 1.0)))), 0,
                      count - 1);
  };
  const auto pattern_level = static_cast<std::size_t>(level_of(step, pattern.level_count));
  const auto frame_level =
      static_cast<std::size_t>(level_of(step * scale, static_cast<int>(pyramid.size())));
  const GrayImage& templates = pattern.levels[pattern_level];
  const GrayImage& image = pyramid[frame_level];
  const double template_shrink = 1.0 / static_cast<double>(1u << pattern_level);
  const double shrink = 1.0 / static_cast<double>(1u << frame_level);
  Verdict verdict;
  std::array<float, kSide * kSide> drawn{};
  std::array<float, kSide * kSide> seen{};
  for (int cell = 0; cell < kCells * kCells; ++cell) {
    bool complete = true;
    for (int k = 0; k < kSide * kSide && complete; ++k) {
      const double u =
          ((cell % kCells) * kSide + k % kSide + 0.5) / (kCells * kSide) * pattern.width();
      const double v =
          (static_cast<int>(cell / kCells) * kSide + static_cast<int>(k / kSide) + 0.5) /
          (kCells * kSide) * pattern.height();
      bool ahead = false;
      const glm::dvec2 p = map.at({u - 0.5, v - 0.5}, ahead);
      const double x = (p.x + 0.5) * shrink - 0.5;
      const double y = (p.y + 0.5) * shrink - 0.5;
      complete = ahead && x >= 0.0 && y >= 0.0 && x < image.width - 1 && y < image.height - 1;
      if (!complete) break;
      const auto at = static_cast<std::size_t>(k);
      seen[at] = sample(image, static_cast<float>(x), static_cast<float>(y));
      const double tx = std::clamp(u * template_shrink - 0.5, 0.0, templates.width - 1.001);
      const double ty = std::clamp(v * template_shrink - 0.5, 0.0, templates.height - 1.001);
      drawn[at] = sample(templates, static_cast<float>(tx), static_cast<float>(ty));
    }
    if (!complete) continue;
    float contrast = 0;
    const float fit = correlation(drawn, seen, contrast);
    if (contrast < kTextured) continue;
    ++verdict.cells;
    if (fit >= kRight) ++verdict.right;
  }
  return verdict;
}

}  // namespace modar::tracker
