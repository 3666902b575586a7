// Coverage of a texture by triangles, dilation by pull-push, flat blocks where nothing is shown.
#include "bake/texture/coverage.hpp"

#include <algorithm>
#include <cmath>

namespace modar {
namespace {

/// Repeats along an axis above which a triangle covers its whole bounding box. Lower covers too
/// much, higher takes time on repeating floors. [2, 8]
constexpr double kMaxRepeats = 4;

using Corners = std::array<std::array<double, 2>, 3>;

/// Texels first to last of a row, unwrapped; none where last < first.
struct Span {
  std::int64_t first = 0;
  std::int64_t last = 0;
};

/// Cuts the span to the texels of row y that are not wholly outside the edge from a to b;
/// `side` is the sign of the triangle's area.
void cut_by_edge(const std::array<double, 2>& a, const std::array<double, 2>& b, double side,
                 std::int64_t y, Span& span) {
  const double nx = (a[1] - b[1]) * side;
  const double ny = (b[0] - a[0]) * side;
  // Of the square at (x, y), the corner farthest inside.
  const double best_y = ny * (static_cast<double>(ny > 0 ? y + 1 : y) - a[1]);
  const auto outside = [&](std::int64_t x) {
    return nx * (static_cast<double>(nx > 0 ? x + 1 : x) - a[0]) + best_y < 0;
  };
  if (nx == 0) {
    if (best_y < 0) span.last = span.first - 1;
    return;
  }
  // Where the edge crosses, give or take a texel that rounding costs.
  const double crossing = std::floor(a[0] - best_y / nx);
  auto x = static_cast<std::int64_t>(
      std::clamp(crossing, static_cast<double>(span.first), static_cast<double>(span.last)));
  if (nx > 0) {
    while (x > span.first && !outside(x - 1)) --x;
    while (x <= span.last && outside(x)) ++x;
    span.first = x;
  } else {
    while (x < span.last && !outside(x + 1)) ++x;
    while (x >= span.first && outside(x)) --x;
    span.last = x;
  }
}

std::size_t wrapped(std::int64_t value, std::uint32_t size) {
  const std::int64_t rest = value % size;
  return static_cast<std::size_t>(rest < 0 ? rest + size : rest);
}

/// Marks a span of row y, wrapped around.
void cover_span(CoverageMask& mask, std::int64_t y, Span span) {
  if (span.last < span.first) return;
  const auto row =
      mask.covered.begin() + static_cast<std::ptrdiff_t>(wrapped(y, mask.height) * mask.width);
  const std::size_t count =
      std::min(static_cast<std::size_t>(span.last - span.first) + 1, std::size_t{mask.width});
  const std::size_t first = wrapped(span.first, mask.width);
  const std::size_t before_edge = std::min(count, mask.width - first);
  std::fill_n(row + static_cast<std::ptrdiff_t>(first), before_edge, std::uint8_t{1});
  std::fill_n(row, count - before_edge, std::uint8_t{1});
  mask.marked += count;
}

void cover_all(CoverageMask& mask) {
  std::fill(mask.covered.begin(), mask.covered.end(), std::uint8_t{1});
  mask.full = true;
}

/// Whether a triangle contains a rectangle of the mask's size, and with it each texel. At a point
/// inside, the edge functions (twice the area of the triangle of point and edge) are positive and
/// add up to twice_area, in any proportion; a rectangle around the point fits where each is at
/// least half of the rectangle's extent along the edge's normal.
bool holds_a_period(const CoverageMask& mask, const Corners& p, double twice_area) {
  double needed = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::array<double, 2>& a = p[i];
    const std::array<double, 2>& b = p[(i + 1) % 3];
    needed += (std::abs(b[1] - a[1]) * mask.width + std::abs(b[0] - a[0]) * mask.height) / 2;
  }
  return twice_area > 0 && twice_area >= needed;
}

/// A level of the pyramid: colours times weight, and weight, in floats.
struct PullLevel {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::array<float, 5>> texels;  ///< r, g, b, a times weight; weight 0-1
};

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

/// Fills the empty texels of a level.
void pull_and_push(PullLevel& level) {
  std::vector<PullLevel> coarser;
  for (const PullLevel* last = &level; last->width > 1 || last->height > 1;
       last = &coarser.back()) {
    coarser.push_back(pull(*last));
  }
  for (std::size_t i = coarser.size(); i-- > 0;) {
    push(coarser[i], i == 0 ? level : coarser[i - 1]);
  }
}

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0F, 255.0F) + 0.5F);
}

/// Whether any texel in these columns and rows, as far as the mask has them, is covered.
bool any_covered(const CoverageMask& mask, const Span& columns, const Span& rows) {
  const std::int64_t left = std::max<std::int64_t>(columns.first, 0);
  const std::int64_t right = std::min<std::int64_t>(columns.last, std::int64_t{mask.width} - 1);
  const std::int64_t bottom = std::min<std::int64_t>(rows.last, std::int64_t{mask.height} - 1);
  for (std::int64_t y = std::max<std::int64_t>(rows.first, 0); y <= bottom; ++y) {
    const std::uint8_t* row = &mask.covered[static_cast<std::size_t>(y * mask.width)];
    if (std::any_of(row + left, row + right + 1, [](std::uint8_t c) { return c != 0; })) {
      return true;
    }
  }
  return false;
}

}  // namespace

CoverageMask make_coverage(std::uint32_t width, std::uint32_t height) {
  return {width, height, std::vector<std::uint8_t>(std::size_t{width} * height)};
}

void cover_triangle(CoverageMask& mask, const std::array<std::array<double, 2>, 3>& uv) {
  if (mask.full) return;
  Corners p;
  bool sane = true;
  for (std::size_t i = 0; i < 3; ++i) {
    p[i] = {uv[i][0] * mask.width, (1 - uv[i][1]) * mask.height};
    sane = sane && std::abs(uv[i][0]) < 1e6 && std::abs(uv[i][1]) < 1e6;
  }
  const double area =
      (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
  if (!sane || holds_a_period(mask, p, std::abs(area))) {
    cover_all(mask);
    return;
  }
  const auto [left, right] = std::minmax({p[0][0], p[1][0], p[2][0]});
  const auto [top, bottom] = std::minmax({p[0][1], p[1][1], p[2][1]});
  const Span columns = {static_cast<std::int64_t>(std::floor(left)),
                        static_cast<std::int64_t>(std::floor(right))};
  const Span rows = {static_cast<std::int64_t>(std::floor(top)),
                     static_cast<std::int64_t>(std::floor(bottom))};
  if (right - left > kMaxRepeats * mask.width || bottom - top > kMaxRepeats * mask.height) {
    const std::int64_t last = std::min(rows.last, rows.first + mask.height - 1);
    for (std::int64_t y = rows.first; y <= last; ++y) cover_span(mask, y, columns);
  } else {
    const double side = area < 0 ? -1 : 1;
    for (std::int64_t y = rows.first; y <= rows.last; ++y) {
      Span span = columns;
      for (std::size_t i = 0; i < 3 && span.first <= span.last; ++i) {
        cut_by_edge(p[i], p[(i + 1) % 3], side, y, span);
      }
      cover_span(mask, y, span);
    }
  }
  if (mask.marked < mask.covered.size()) return;
  // Looked at as rarely as the texels were marked once over, which costs less than marking them.
  mask.marked = 0;
  mask.full = std::find(mask.covered.begin(), mask.covered.end(), 0) == mask.covered.end();
}

CoverageMask resize_coverage(const CoverageMask& mask, std::uint32_t width, std::uint32_t height) {
  CoverageMask out = make_coverage(width, height);
  // The texels of the mask that one of the result touches in a direction.
  const auto touched = [](std::uint64_t i, std::uint64_t from, std::uint64_t to) {
    return Span{static_cast<std::int64_t>(i * from / to),
                static_cast<std::int64_t>(((i + 1) * from - 1) / to)};
  };
  std::vector<Span> columns;
  for (std::uint32_t x = 0; x < width; ++x) columns.push_back(touched(x, mask.width, width));
  for (std::uint32_t y = 0; y < height; ++y) {
    const Span rows = touched(y, mask.height, height);
    for (std::uint32_t x = 0; x < width; ++x) {
      out.covered[std::size_t{y} * width + x] = any_covered(mask, columns[x], rows) ? 1 : 0;
    }
  }
  return out;
}

void fill_uncovered(RgbaImage& image, const CoverageMask& mask) {
  const std::vector<std::uint8_t>& covered = mask.covered;
  if (std::all_of(covered.begin(), covered.end(), [](std::uint8_t c) { return c == 0; })) return;
  PullLevel level{image.width, image.height, {}};
  level.texels.resize(covered.size());
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (covered[i] == 0) continue;
    for (std::size_t c = 0; c < 4; ++c) level.texels[i][c] = image.pixels[4 * i + c];
    level.texels[i][4] = 1;
  }
  pull_and_push(level);
  for (std::size_t i = 0; i < covered.size(); ++i) {
    if (covered[i] != 0) continue;
    for (std::size_t c = 0; c < 4; ++c) image.pixels[4 * i + c] = to_byte(level.texels[i][c]);
  }
}

void fill_transparent(RgbaImage& image) {
  PullLevel level{image.width, image.height, {}};
  level.texels.resize(image.pixels.size() / 4);
  bool any_visible = false;
  bool any_hidden = false;
  for (std::size_t i = 0; i < level.texels.size(); ++i) {
    const std::uint8_t* pixel = &image.pixels[4 * i];
    const float weight = static_cast<float>(pixel[3]) / 255;
    for (std::size_t c = 0; c < 3; ++c) level.texels[i][c] = pixel[c] * weight;
    level.texels[i][4] = weight;
    (pixel[3] == 0 ? any_hidden : any_visible) = true;
  }
  if (!any_visible || !any_hidden) return;
  pull_and_push(level);
  for (std::size_t i = 0; i < level.texels.size(); ++i) {
    if (image.pixels[4 * i + 3] != 0) continue;
    for (std::size_t c = 0; c < 3; ++c) image.pixels[4 * i + c] = to_byte(level.texels[i][c]);
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
      if (any_covered(mask, {left - 1, left + 4}, {top - 1, top + 4})) continue;
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
