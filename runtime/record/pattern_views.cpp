// Renders affine views by averaging samples over each pixel's footprint, and finds their features.
#include "modar/pattern_views.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "runtime/record/view_kernel.hpp"

namespace modar {
namespace {

// Samples along a side of a footprint at most. More are exact for steeper views and slower.
constexpr int kMostSamples = 6;

// Positions in a level are fixed-point numbers with 16 fractional bits, so that every machine
// renders the same bytes.
constexpr double kOne = 65536.0;

std::int32_t fixed(double value) {
  return static_cast<std::int32_t>(std::lround(value * kOne));
}

/// A weighted sum of four pixels with 16 fractional bits. (x0, y0) and its neighbours to the right
/// and below are in the picture.
std::int32_t bilinear(const GrayPicture& picture, int x0, int y0, std::int32_t fx,
                      std::int32_t fy) {
  const std::uint8_t* p =
      picture.pixels.data() + static_cast<std::ptrdiff_t>(y0) * picture.width + x0;
  const std::uint8_t* q = p + picture.width;
  const std::int32_t top = (p[0] << 8) + fx * (p[1] - p[0]);
  const std::int32_t bottom = (q[0] << 8) + fx * (q[1] - q[0]);
  return (top << 8) + fy * (bottom - top);
}

/// The picture at (x, y), its border repeated outside.
std::int32_t sample_anywhere(const GrayPicture& picture, std::int32_t x, std::int32_t y) {
  x = std::clamp(x, 0, (picture.width - 1) << 16);
  y = std::clamp(y, 0, (picture.height - 1) << 16);
  const int x0 = std::min(x >> 16, picture.width - 2);
  const int y0 = std::min(y >> 16, picture.height - 2);
  return bilinear(picture, x0, y0, (x - (x0 << 16)) >> 8, (y - (y0 << 16)) >> 8);
}

/// Offsets of a pixel's samples from its centre, in pixels of the level.
struct Footprint {
  std::vector<std::array<std::int32_t, 2>> offsets;
  std::int32_t reach_x = 0;  ///< of the offsets
  std::int32_t reach_y = 0;
};

Footprint footprint_of(const std::array<double, 4>& inverse, double factor) {
  const auto samples = [factor](double dx, double dy) {
    return std::clamp(static_cast<int>(std::ceil(std::sqrt(dx * dx + dy * dy) / factor)), 1,
                      kMostSamples);
  };
  const int across = samples(inverse[0], inverse[2]);
  const int down = samples(inverse[1], inverse[3]);
  Footprint footprint;
  for (int v = 0; v < down; ++v) {
    for (int u = 0; u < across; ++u) {
      const double x = (u + 0.5) / across - 0.5;
      const double y = (v + 0.5) / down - 0.5;
      const std::int32_t dx = fixed((inverse[0] * x + inverse[1] * y) / factor);
      const std::int32_t dy = fixed((inverse[2] * x + inverse[3] * y) / factor);
      footprint.offsets.push_back({dx, dy});
      footprint.reach_x = std::max(footprint.reach_x, std::abs(dx));
      footprint.reach_y = std::max(footprint.reach_y, std::abs(dy));
    }
  }
  return footprint;
}

/// Samples rows of pixels from one level.
class Sampler {
 public:
  Sampler(const ViewLevel& level, const GrayPicture& finest, const std::array<double, 4>& inverse,
          double factor)
      : level_(level),
        footprint_(footprint_of(inverse, factor)),
        samples_{level.quads.data(), level.width, level.height, footprint_.offsets},
        right_(fixed(finest.width / factor - 0.5)),
        bottom_(fixed(finest.height / factor - 0.5)) {}

  /// x, y: the centres of the row's pixels, both monotonic along the row. behind: grays outside of
  /// the picture, null: its border pixels.
  void row(std::span<const std::int32_t> x, std::span<const std::int32_t> y,
           const std::uint8_t* behind, std::uint8_t* out) const {
    if (behind == nullptr) return sample_pixels(samples_, x.data(), y.data(), x.size(), out);
    for (std::size_t first = 0; first < x.size(); first += kRun) {
      const std::size_t count = std::min(kRun, x.size() - first);
      const std::size_t last = first + count - 1;
      if (inside(x[first], y[first]) && inside(x[last], y[last])) {
        sample_pixels(samples_, x.data() + first, y.data() + first, count, out + first);
      } else if (beside(x[first], x[last], footprint_.reach_x, right_) ||
                 beside(y[first], y[last], footprint_.reach_y, bottom_)) {
        std::copy_n(behind + first, count, out + first);
      } else {
        for (std::size_t i = first; i <= last; ++i) out[i] = pixel(x[i], y[i], behind[i]);
      }
    }
  }

 private:
  // Pixels classified together: one AVX-512 vector of 32-bit lanes.
  static constexpr std::size_t kRun = 16;

  /// All samples of a pixel are in the picture.
  [[nodiscard]] bool inside(std::int32_t x, std::int32_t y) const {
    return x >= footprint_.reach_x && y >= footprint_.reach_y &&
           x < ((level_.width - 1) << 16) - footprint_.reach_x &&
           y < ((level_.height - 1) << 16) - footprint_.reach_y;
  }
  /// All samples of the pixels from `from` to `to` are on the same side of the picture.
  static bool beside(std::int32_t from, std::int32_t to, std::int32_t reach, std::int32_t end) {
    return std::max(from, to) + reach < -0x8000 || std::min(from, to) - reach > end;
  }
  [[nodiscard]] bool outside(std::int32_t x, std::int32_t y) const {
    return x < -0x8000 || y < -0x8000 || x > right_ || y > bottom_;
  }
  [[nodiscard]] std::uint8_t pixel(std::int32_t x, std::int32_t y, std::uint8_t behind) const {
    std::int32_t sum = 0;
    for (const auto& [dx, dy] : footprint_.offsets) {
      sum += outside(x + dx, y + dy) ? behind << 16 : sample_anywhere(level_, x + dx, y + dy);
    }
    const auto count = static_cast<std::int32_t>(footprint_.offsets.size());
    return static_cast<std::uint8_t>((sum / count + 0x8000) >> 16);
  }

  const ViewLevel& level_;
  Footprint footprint_;
  ViewSamples samples_;
  std::int32_t right_;
  std::int32_t bottom_;
};

/// The words that sample_pixels() reads.
std::vector<std::uint32_t> quads_of(const GrayPicture& level) {
  std::vector<std::uint32_t> quads(level.pixels.size());
  for (int y = 0; y + 1 < level.height; ++y) {
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width);
    const std::uint8_t* p = level.pixels.data() + first;
    const std::uint8_t* q = p + level.width;
    for (int x = 0; x + 1 < level.width; ++x) {
      quads[first + static_cast<std::size_t>(x)] =
          static_cast<std::uint32_t>(p[x] | p[x + 1] << 8 | q[x] << 16) |
          static_cast<std::uint32_t>(q[x + 1]) << 24;
    }
  }
  return quads;
}

}  // namespace

double exp_of(double x) {
  const double eighth = x / 8;
  double power = 1;
  for (int k = 18; k > 0; --k) power = 1 + power * eighth / k;
  for (int i = 0; i < 3; ++i) power *= power;
  return power;
}

AffineView make_view(int picture_width, int picture_height, double scale, double tilt,
                     Turn direction, Turn rotation, int margin) {
  const auto [c, s] = direction;
  const double along = scale / tilt;
  // Compression along (c, s) and none across.
  const double xx = along * c * c + scale * s * s;
  const double xy = (along - scale) * c * s;
  const double yy = along * s * s + scale * c * c;
  const auto [cr, sr] = rotation;
  AffineView view;
  view.linear = {cr * xx - sr * xy, cr * xy - sr * yy, sr * xx + cr * xy, sr * xy + cr * yy};
  const double half_width = 0.5 * picture_width;
  const double half_height = 0.5 * picture_height;
  const auto& a = view.linear;
  const double reach_x = std::abs(a[0]) * half_width + std::abs(a[1]) * half_height;
  const double reach_y = std::abs(a[2]) * half_width + std::abs(a[3]) * half_height;
  view.width = static_cast<int>(std::ceil(2 * reach_x)) + 2 * margin;
  view.height = static_cast<int>(std::ceil(2 * reach_y)) + 2 * margin;
  const double cx = half_width - 0.5;
  const double cy = half_height - 0.5;
  view.offset = {0.5 * (view.width - 1) - a[0] * cx - a[1] * cy,
                 0.5 * (view.height - 1) - a[2] * cx - a[3] * cy};
  return view;
}

std::vector<GrayPicture> halved(const GrayImage& picture) {
  std::vector<GrayPicture> levels(1);
  levels[0].width = picture.width;
  levels[0].height = picture.height;
  for (int y = 0; y < picture.height; ++y) {
    const std::uint8_t* row = picture.pixels + y * picture.stride;
    levels[0].pixels.insert(levels[0].pixels.end(), row, row + picture.width);
  }
  while (std::min(levels.back().width, levels.back().height) >= 16 && levels.size() < 8) {
    const GrayPicture& from = levels.back();
    GrayPicture to;
    to.width = from.width / 2;
    to.height = from.height / 2;
    for (int y = 0; y < to.height; ++y) {
      const std::uint8_t* top = from.pixels.data() + std::ptrdiff_t{2} * y * from.width;
      const std::uint8_t* bottom = top + from.width;
      for (int x = 0; x < to.width; ++x) {
        const int sum = top[2 * x] + top[2 * x + 1] + bottom[2 * x] + bottom[2 * x + 1];
        to.pixels.push_back(static_cast<std::uint8_t>((sum + 2) >> 2));
      }
    }
    levels.push_back(std::move(to));
  }
  return levels;
}

std::vector<ViewLevel> view_levels(const GrayImage& picture) {
  std::vector<ViewLevel> levels;
  for (GrayPicture& level : halved(picture)) {
    std::vector<std::uint32_t> quads = quads_of(level);
    levels.push_back({std::move(level), std::move(quads)});
  }
  return levels;
}

GrayPicture made_clutter(Random& random, int width, int height) {
  GrayPicture picture;
  picture.width = width;
  picture.height = height;
  picture.pixels.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 128);
  for (int i = 0; i < width * height / 400; ++i) {
    const int x0 = static_cast<int>(random.uniform(0, width));
    const int y0 = static_cast<int>(random.uniform(0, height));
    const int x1 = std::min(width, x0 + static_cast<int>(random.uniform(2, 24)));
    const int y1 = std::min(height, y0 + static_cast<int>(random.uniform(2, 24)));
    const auto gray = static_cast<std::uint8_t>(random.uniform(0, 256));
    for (int y = y0; y < y1; ++y) {
      std::fill_n(picture.pixels.begin() + static_cast<std::ptrdiff_t>(y) * width + x0, x1 - x0,
                  gray);
    }
  }
  return picture;
}

namespace {

/// background: of the part's size, or null.
GrayPicture render(const std::vector<ViewLevel>& levels, const AffineView& view,
                   const ViewPart& part, const GrayPicture* background) {
  const auto& a = view.linear;
  const double determinant = a[0] * a[3] - a[1] * a[2];
  const std::array<double, 4> inverse = {a[3] / determinant, -a[1] / determinant,
                                         -a[2] / determinant, a[0] / determinant};
  // The level whose pixels are no coarser than the view's along its least compressed direction.
  const double trace = a[0] * a[0] + a[1] * a[1] + a[2] * a[2] + a[3] * a[3];
  const double gap = std::sqrt(std::max(0.0, trace * trace - 4 * determinant * determinant));
  const double largest = std::sqrt(0.5 * (trace + gap));
  std::size_t level = 0;
  double factor = 1.0;
  while (level + 1 < levels.size() && largest * factor * 2 <= 1.0) {
    ++level;
    factor *= 2;
  }
  const Sampler sampler(levels[level], levels[0], inverse, factor);
  // A pixel's position is stepped along a row with 32 fractional bits.
  constexpr double kFine = 4294967296.0;
  const std::int64_t step_x = std::llround(inverse[0] / factor * kFine);
  const std::int64_t step_y = std::llround(inverse[2] / factor * kFine);
  GrayPicture out;
  out.width = part.width;
  out.height = part.height;
  const auto width = static_cast<std::size_t>(out.width);
  out.pixels.resize(width * static_cast<std::size_t>(out.height));
  std::vector<std::int32_t> xs(width);
  std::vector<std::int32_t> ys(width);
  for (int y = 0; y < out.height; ++y) {
    const double u = -view.offset[0];
    const double v = part.top + y - view.offset[1];
    // From the view's first pixel on, so that parts of it have its very pixels.
    std::int64_t px =
        std::llround(((inverse[0] * u + inverse[1] * v + 0.5) / factor - 0.5) * kFine) +
        part.left * step_x;
    std::int64_t py =
        std::llround(((inverse[2] * u + inverse[3] * v + 0.5) / factor - 0.5) * kFine) +
        part.left * step_y;
    for (std::size_t x = 0; x < width; ++x, px += step_x, py += step_y) {
      xs[x] = static_cast<std::int32_t>(px >> 16);
      ys[x] = static_cast<std::int32_t>(py >> 16);
    }
    const std::size_t first = width * static_cast<std::size_t>(y);
    sampler.row(xs, ys, background != nullptr ? background->pixels.data() + first : nullptr,
                out.pixels.data() + first);
  }
  return out;
}

}  // namespace

GrayPicture render_view(const std::vector<ViewLevel>& levels, const AffineView& view,
                        const GrayPicture* background) {
  return render(levels, view, {0, 0, view.width, view.height}, background);
}

GrayPicture render_part(const std::vector<ViewLevel>& levels, const AffineView& view,
                        const ViewPart& part) {
  return render(levels, view, part, nullptr);
}

namespace {

constexpr int kTile = 12;  // pixels of the picture: a bottle bends away by a hundredth of it

/// A tile's middle in the picture, there in the view, and the affine map between their pixels.
struct Tile {
  double x = 0;
  double y = 0;
  double u = 0;
  double v = 0;
  std::array<double, 4> linear{};
  std::array<double, 4> edges{};  ///< left, top, right and bottom of its part of the picture
  bool visible = false;
};

Tile tile_at(const PatternSurface& surface, const ViewAxes& axes, double scale, double x,
             double y) {
  const SurfacePoint point = surface.at(x, y);
  const auto along = [&](std::size_t row, const std::array<double, 3>& vector) {
    return axes[row][0] * vector[0] + axes[row][1] * vector[1] + axes[row][2] * vector[2];
  };
  // A pixel of the picture is `scale` pixels of the view wide where it faces the camera.
  const double unit = scale * 0.5 * std::max(surface.width(), surface.height());
  Tile tile;
  tile.x = x;
  tile.y = y;
  tile.u = unit * along(0, point.at);
  tile.v = unit * along(1, point.at);
  tile.linear = {unit * along(0, point.right), unit * along(0, point.down),
                 unit * along(1, point.right), unit * along(1, point.down)};
  // Turned to the camera by more than 78 degrees from its edge: a determinant of a fifth.
  const auto& a = tile.linear;
  tile.visible = a[0] * a[3] - a[1] * a[2] > 0.2 * scale * scale;
  return tile;
}

/// The tiles of the picture, or of each of its faces.
std::vector<Tile> tiles_of(const PatternSurface& surface, const ViewAxes& axes, double scale) {
  std::vector<Tile> tiles;
  // A little more than the tile, so that neighbours leave no gap, but nothing of the next face.
  constexpr double kMore = 0.25;
  const auto add = [&](int left, int top, int width, int height) {
    for (int y = 0; y < height; y += kTile) {
      for (int x = 0; x < width; x += kTile) {
        const int wide = std::min(kTile, width - x);
        const int high = std::min(kTile, height - y);
        Tile tile =
            tile_at(surface, axes, scale, left + x + 0.5 * wide - 0.5, top + y + 0.5 * high - 0.5);
        tile.edges = {std::max(left + x - kMore, 1.0 * left) - 0.5,
                      std::max(top + y - kMore, 1.0 * top) - 0.5,
                      std::min(left + x + wide + kMore, 1.0 * left + width) - 0.5,
                      std::min(top + y + high + kMore, 1.0 * top + height) - 0.5};
        tiles.push_back(tile);
      }
    }
  };
  if (surface.faces().empty()) {
    add(0, 0, static_cast<int>(surface.width()), static_cast<int>(surface.height()));
  }
  for (const ShapeFaceRecord& face : surface.faces()) {
    add(face.place[0], face.place[1], face.place[2], face.place[3]);
  }
  return tiles;
}

/// The pixels of the view whose places are in the tile, row by row, from one level.
void draw_tile(const std::vector<ViewLevel>& levels, const Tile& tile, double offset_u,
               double offset_v, double scale, CurvedView& view) {
  const auto& a = tile.linear;
  const double determinant = a[0] * a[3] - a[1] * a[2];
  const std::array<double, 4> inverse = {a[3] / determinant, -a[1] / determinant,
                                         -a[2] / determinant, a[0] / determinant};
  std::size_t level = 0;
  double factor = 1.0;
  while (level + 1 < levels.size() && scale * factor * 2 <= 1.0) {
    ++level;
    factor *= 2;
  }
  const Footprint footprint = footprint_of(inverse, factor);
  const ViewSamples samples{levels[level].quads.data(), levels[level].width, levels[level].height,
                            footprint.offsets};
  constexpr double kReach = 0.5 * kTile + 1.0;
  const double reach_u = kReach * (std::abs(a[0]) + std::abs(a[1]));
  const double reach_v = kReach * (std::abs(a[2]) + std::abs(a[3]));
  const double u = tile.u + offset_u;
  const double v = tile.v + offset_v;
  const int left = std::max(0, static_cast<int>(std::ceil(u - reach_u)));
  const int right = std::min(view.picture.width - 1, static_cast<int>(std::floor(u + reach_u)));
  const int bottom = std::min(view.picture.height - 1, static_cast<int>(std::floor(v + reach_v)));
  std::vector<std::int32_t> xs;
  std::vector<std::int32_t> ys;
  for (int y = std::max(0, static_cast<int>(std::ceil(v - reach_v))); y <= bottom; ++y) {
    xs.clear();
    ys.clear();
    std::size_t first = 0;
    for (int x = left; x <= right; ++x) {
      const double px = tile.x + inverse[0] * (x - u) + inverse[1] * (y - v);
      const double py = tile.y + inverse[2] * (x - u) + inverse[3] * (y - v);
      if (px < tile.edges[0] || py < tile.edges[1] || px > tile.edges[2] || py > tile.edges[3]) {
        continue;
      }
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(view.picture.width) +
          static_cast<std::size_t>(x);
      // The inside of a parallelogram is one run of a row.
      if (xs.empty()) first = at;
      xs.push_back(fixed((px + 0.5) / factor - 0.5));
      ys.push_back(fixed((py + 0.5) / factor - 0.5));
      view.places[at] = {static_cast<std::uint16_t>(std::lround((px + 0.5) * 64)),
                         static_cast<std::uint16_t>(std::lround((py + 0.5) * 64))};
    }
    if (!xs.empty()) {
      sample_pixels(samples, xs.data(), ys.data(), xs.size(), &view.picture.pixels[first]);
    }
  }
}

}  // namespace

CurvedView render_surface_view(
    const std::vector<ViewLevel>& levels, const PatternSurface& surface, const ViewAxes& axes,
    double scale, int margin, const std::function<GrayPicture(int width, int height)>& background) {
  const std::vector<Tile> tiles = tiles_of(surface, axes, scale);
  double low_u = 1e9, high_u = -1e9, low_v = 1e9, high_v = -1e9;
  for (const Tile& tile : tiles) {
    if (!tile.visible) continue;
    low_u = std::min(low_u, tile.u);
    high_u = std::max(high_u, tile.u);
    low_v = std::min(low_v, tile.v);
    high_v = std::max(high_v, tile.v);
  }
  if (low_u > high_u) low_u = high_u = low_v = high_v = 0;
  const double offset_u = margin - low_u;
  const double offset_v = margin - low_v;
  CurvedView view;
  view.picture = background(static_cast<int>(std::ceil(high_u - low_u)) + 2 * margin,
                            static_cast<int>(std::ceil(high_v - low_v)) + 2 * margin);
  view.places.assign(view.picture.pixels.size(), {CurvedView::kNoPlace, CurvedView::kNoPlace});
  for (const Tile& tile : tiles) {
    if (tile.visible) draw_tile(levels, tile, offset_u, offset_v, scale, view);
  }
  return view;
}

std::array<double, 2> to_picture(const AffineView& view, double x, double y) {
  const auto& a = view.linear;
  const double determinant = a[0] * a[3] - a[1] * a[2];
  const double u = x - view.offset[0];
  const double v = y - view.offset[1];
  return {(a[3] * u - a[1] * v) / determinant, (a[0] * v - a[2] * u) / determinant};
}

DetectOptions generous_detection() {
  DetectOptions options;
  // Sixteen corners in each cell of 32 pixels, several times what the default allows: the bake and
  // the score choose among them. 20,000 is more than a view of 720 pixels holds.
  options.cell = 32;
  options.per_cell = 16;
  options.max_features = 20000;
  return options;
}

}  // namespace modar
