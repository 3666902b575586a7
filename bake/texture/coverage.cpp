// Coverage of a texture by triangles, dilation by pull-push, flat blocks where nothing is shown.
#include "bake/texture/coverage.hpp"

#include <algorithm>
#include <cmath>

namespace modar {
namespace {

constexpr double kMaxRepeats = 64;

using Corners = std::array<std::array<double, 2>, 3>;

/// Whether the unit square at (x, y) lies wholly outside of the edge from a to b; `side` is the
/// sign of the triangle's area.
bool outside_edge(const std::array<double, 2>& a, const std::array<double, 2>& b, double side,
                  double x, double y) {
  const double nx = (a[1] - b[1]) * side;
  const double ny = (b[0] - a[0]) * side;
  const double best_x = nx > 0 ? x + 1 : x;
  const double best_y = ny > 0 ? y + 1 : y;
  return nx * (best_x - a[0]) + ny * (best_y - a[1]) < 0;
}

bool touches(const Corners& p, double side, double x, double y) {
  return !outside_edge(p[0], p[1], side, x, y) && !outside_edge(p[1], p[2], side, x, y) &&
         !outside_edge(p[2], p[0], side, x, y);
}

std::size_t wrapped(std::int64_t value, std::uint32_t size) {
  const std::int64_t rest = value % size;
  return static_cast<std::size_t>(rest < 0 ? rest + size : rest);
}

/// A level of the pyramid: colours times weight, and weight, in floats.
struct PullLevel {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::array<float, 5>> texels;  ///< r, g, b, a times weight; weight 0-1
};

PullLevel first_level(const RgbaImage& image, const CoverageMask& mask) {
  PullLevel level{image.width, image.height, {}};
  level.texels.resize(mask.covered.size());
  for (std::size_t i = 0; i < mask.covered.size(); ++i) {
    if (mask.covered[i] == 0) continue;
    for (std::size_t c = 0; c < 4; ++c) level.texels[i][c] = image.pixels[4 * i + c];
    level.texels[i][4] = 1;
  }
  return level;
}

PullLevel pull(const PullLevel& fine) {
  PullLevel coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
  coarse.texels.resize(std::size_t{coarse.width} * coarse.height);
  for (std::size_t y = 0; y < fine.height; ++y) {
    for (std::size_t x = 0; x < fine.width; ++x) {
      std::array<float, 5>& to = coarse.texels[y / 2 * coarse.width + x / 2];
      const std::array<float, 5>& from = fine.texels[y * fine.width + x];
      for (std::size_t c = 0; c < 5; ++c) to[c] += from[c];
    }
  }
  for (std::array<float, 5>& texel : coarse.texels) {
    if (texel[4] <= 1) continue;
    for (std::size_t c = 0; c < 4; ++c) texel[c] /= texel[4];
    texel[4] = 1;
  }
  return coarse;
}

/// Gives the fine level's empty texels the colour of the coarse one's.
void push(const PullLevel& coarse, PullLevel& fine) {
  for (std::size_t y = 0; y < fine.height; ++y) {
    for (std::size_t x = 0; x < fine.width; ++x) {
      std::array<float, 5>& to = fine.texels[y * fine.width + x];
      if (to[4] >= 1) continue;
      const std::array<float, 5>& from = coarse.texels[y / 2 * coarse.width + x / 2];
      for (std::size_t c = 0; c < 5; ++c) to[c] += (1 - to[4]) * from[c];
      to[4] = 1;
    }
  }
}

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0F, 255.0F) + 0.5F);
}

/// Whether any texel of the rectangle [left, right) x [top, bottom), cut to the mask, is covered.
bool any_covered(const CoverageMask& mask, std::int64_t left, std::int64_t top, std::int64_t right,
                 std::int64_t bottom) {
  for (std::int64_t y = std::max<std::int64_t>(top, 0);
       y < std::min<std::int64_t>(bottom, mask.height); ++y) {
    for (std::int64_t x = std::max<std::int64_t>(left, 0);
         x < std::min<std::int64_t>(right, mask.width); ++x) {
      if (mask.covered[static_cast<std::size_t>(y * mask.width + x)] != 0) return true;
    }
  }
  return false;
}

}  // namespace

CoverageMask make_coverage(std::uint32_t width, std::uint32_t height) {
  return {width, height, std::vector<std::uint8_t>(std::size_t{width} * height)};
}

void cover_triangle(CoverageMask& mask, const std::array<std::array<double, 2>, 3>& uv) {
  Corners p;
  bool sane = true;
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = {uv[i][0] * mask.width, (1 - uv[i][1]) * mask.height};
    sane = sane && std::abs(uv[i][0]) < 1e6 && std::abs(uv[i][1]) < 1e6;
  }
  const auto [left, right] = std::minmax({p[0][0], p[1][0], p[2][0]});
  const auto [top, bottom] = std::minmax({p[0][1], p[1][1], p[2][1]});
  if (!sane || right - left > kMaxRepeats * mask.width ||
      bottom - top > kMaxRepeats * mask.height) {
    std::fill(mask.covered.begin(), mask.covered.end(), std::uint8_t{1});
    return;
  }
  const double area =
      (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
  const double side = area < 0 ? -1 : 1;
  const auto first_x = static_cast<std::int64_t>(std::floor(left));
  const auto first_y = static_cast<std::int64_t>(std::floor(top));
  for (std::int64_t y = first_y; static_cast<double>(y) <= bottom; ++y) {
    const std::size_t row = wrapped(y, mask.height) * mask.width;
    for (std::int64_t x = first_x; static_cast<double>(x) <= right; ++x) {
      if (!touches(p, side, static_cast<double>(x), static_cast<double>(y))) continue;
      mask.covered[row + wrapped(x, mask.width)] = 1;
    }
  }
}

CoverageMask resize_coverage(const CoverageMask& mask, std::uint32_t width, std::uint32_t height) {
  CoverageMask out = make_coverage(width, height);
  const auto first = [](std::uint64_t i, std::uint32_t from, std::uint32_t to) {
    return static_cast<std::int64_t>(i * from / to);
  };
  const auto end = [](std::uint64_t i, std::uint32_t from, std::uint32_t to) {
    return static_cast<std::int64_t>(((i + 1) * from + to - 1) / to);
  };
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      out.covered[std::size_t{y} * width + x] =
          any_covered(mask, first(x, mask.width, width), first(y, mask.height, height),
                      end(x, mask.width, width), end(y, mask.height, height))
              ? 1
              : 0;
    }
  }
  return out;
}

void fill_uncovered(RgbaImage& image, const CoverageMask& mask) {
  if (std::count(mask.covered.begin(), mask.covered.end(), 0) ==
      static_cast<std::ptrdiff_t>(mask.covered.size())) {
    return;
  }
  std::vector<PullLevel> levels = {first_level(image, mask)};
  while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(pull(levels.back()));
  for (std::size_t i = levels.size() - 1; i-- > 0;) push(levels[i + 1], levels[i]);
  for (std::size_t i = 0; i < mask.covered.size(); ++i) {
    if (mask.covered[i] != 0) continue;
    for (std::size_t c = 0; c < 4; ++c) {
      image.pixels[4 * i + c] = to_byte(levels[0].texels[i][c]);
    }
  }
}

void flatten_uncovered_blocks(RgbaImage& image, const CoverageMask& mask) {
  std::array<std::uint64_t, 4> sum{};
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < mask.covered.size(); ++i) {
    if (mask.covered[i] == 0) continue;
    for (std::size_t c = 0; c < 4; ++c) sum[c] += image.pixels[4 * i + c];
    ++count;
  }
  if (count == 0) return;
  std::array<std::uint8_t, 4> mean{};
  for (std::size_t c = 0; c < 4; ++c) {
    mean[c] = static_cast<std::uint8_t>((sum[c] + count / 2) / count);
  }
  for (std::int64_t top = 0; top < image.height; top += 4) {
    for (std::int64_t left = 0; left < image.width; left += 4) {
      if (any_covered(mask, left - 1, top - 1, left + 5, top + 5)) continue;
      for (std::int64_t y = top; y < std::min<std::int64_t>(top + 4, image.height); ++y) {
        for (std::int64_t x = left; x < std::min<std::int64_t>(left + 4, image.width); ++x) {
          std::copy(mean.begin(), mean.end(),
                    image.pixels.begin() + 4 * (y * std::int64_t{image.width} + x));
        }
      }
    }
  }
}

}  // namespace modar
