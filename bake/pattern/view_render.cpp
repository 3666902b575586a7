// Renders affine views by averaging samples over each pixel's footprint.
#include "bake/pattern/view_render.hpp"

#include <algorithm>
#include <cmath>

namespace modar {
namespace {

constexpr int kMostSamples = 6;  // on a side of a footprint

/// A level with the picture's border repeated where a sample falls outside of it.
float bilinear(const GrayPicture& picture, float x, float y) {
  x = std::clamp(x, 0.0f, static_cast<float>(picture.width - 1));
  y = std::clamp(y, 0.0f, static_cast<float>(picture.height - 1));
  const int x0 = std::min(static_cast<int>(x), picture.width - 2);
  const int y0 = std::min(static_cast<int>(y), picture.height - 2);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const std::uint8_t* p =
      picture.pixels.data() + static_cast<std::ptrdiff_t>(y0) * picture.width + x0;
  const float top = p[0] + fx * static_cast<float>(p[1] - p[0]);
  const std::uint8_t* q = p + picture.width;
  const float bottom = q[0] + fx * static_cast<float>(q[1] - q[0]);
  return top + fy * (bottom - top);
}

/// Places of a pixel's samples around its centre, in pixels of the level.
struct Footprint {
  std::vector<std::array<float, 2>> offsets;
};

Footprint footprint_of(const std::array<double, 4>& inverse, double factor) {
  const auto samples = [factor](double dx, double dy) {
    return std::clamp(static_cast<int>(std::ceil(std::hypot(dx, dy) / factor)), 1, kMostSamples);
  };
  const int across = samples(inverse[0], inverse[2]);
  const int down = samples(inverse[1], inverse[3]);
  Footprint footprint;
  for (int v = 0; v < down; ++v) {
    for (int u = 0; u < across; ++u) {
      const double x = (u + 0.5) / across - 0.5;
      const double y = (v + 0.5) / down - 0.5;
      footprint.offsets.push_back({static_cast<float>((inverse[0] * x + inverse[1] * y) / factor),
                                   static_cast<float>((inverse[2] * x + inverse[3] * y) / factor)});
    }
  }
  return footprint;
}

}  // namespace

std::uint64_t Random::next() {
  state_ += 0x9E3779B97F4A7C15ull;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

double Random::uniform(double low, double high) {
  return low + (high - low) * (static_cast<double>(next() >> 11) * 0x1.0p-53);
}

double Random::normal() {
  // Three uniforms of 16 bits, whose sum has the variance 1/4.
  const std::uint64_t bits = next();
  const auto sum =
      static_cast<double>((bits & 0xFFFF) + ((bits >> 16) & 0xFFFF) + ((bits >> 32) & 0xFFFF));
  return 2.0 * (sum / 65536.0 - 1.5);
}

AffineView make_view(int picture_width, int picture_height, double scale, double tilt,
                     double direction, double rotation, int margin) {
  const double c = std::cos(direction);
  const double s = std::sin(direction);
  const double along = scale / tilt;
  // Compression along (c, s) and none across.
  const double xx = along * c * c + scale * s * s;
  const double xy = (along - scale) * c * s;
  const double yy = along * s * s + scale * c * c;
  const double cr = std::cos(rotation);
  const double sr = std::sin(rotation);
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

GrayPicture render_view(const std::vector<GrayPicture>& levels, const AffineView& view,
                        const GrayPicture* background) {
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
  const GrayPicture& from = levels[level];
  const Footprint footprint = footprint_of(inverse, factor);
  const float share = 1.0f / static_cast<float>(footprint.offsets.size());
  const float right = static_cast<float>(levels[0].width / factor) - 0.5f;
  const float bottom = static_cast<float>(levels[0].height / factor) - 0.5f;
  GrayPicture out;
  out.width = view.width;
  out.height = view.height;
  out.pixels.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
  std::uint8_t* pixel = out.pixels.data();
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x, ++pixel) {
      const double u = x - view.offset[0];
      const double v = y - view.offset[1];
      const auto px = static_cast<float>((inverse[0] * u + inverse[1] * v + 0.5) / factor - 0.5);
      const auto py = static_cast<float>((inverse[2] * u + inverse[3] * v + 0.5) / factor - 0.5);
      const float behind =
          background != nullptr
              ? background->pixels[static_cast<std::size_t>(pixel - out.pixels.data())]
              : 0.0f;
      float sum = 0.0f;
      for (const auto& offset : footprint.offsets) {
        const float sx = px + offset[0];
        const float sy = py + offset[1];
        const bool outside = sx < -0.5f || sy < -0.5f || sx > right || sy > bottom;
        sum += outside && background != nullptr ? behind : bilinear(from, sx, sy);
      }
      *pixel = static_cast<std::uint8_t>(sum * share + 0.5f);
    }
  }
  return out;
}

}  // namespace modar
