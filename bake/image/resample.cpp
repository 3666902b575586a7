// Change of size and mip levels in linear light: sRGB tables and a separable filter.
#include "bake/image/resample.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/base/colour.hpp"
#include "formats/base/parallel.hpp"

namespace modar {
namespace {

/// Rounded to multiples of 2^-23: the last bits of pow() differ between C libraries.
float steady(double value) {
  return static_cast<float>(std::round(value * 0x1p23) * 0x1p-23);
}

struct SrgbTables {
  /// Cells of equal size between 0 and 1: at most two results fall into one.
  static constexpr std::size_t kCells = 4096;
  std::array<float, 256> linear{};
  std::array<float, 255> threshold{};  ///< linear values half-way between value k and k + 1
  std::array<std::uint8_t, kCells + 1> first{};  ///< the result for the least value of each cell
  SrgbTables() {
    for (std::size_t i = 0; i < 256; ++i) {
      linear[i] = steady(linear_of_srgb(static_cast<double>(i) / 255));
    }
    for (std::size_t i = 0; i < 255; ++i) {
      threshold[i] = steady(linear_of_srgb((static_cast<double>(i) + 0.5) / 255));
    }
    for (std::size_t i = 0; i <= kCells; ++i) {
      const float least = static_cast<float>(i) / kCells;
      const auto above = std::upper_bound(threshold.begin(), threshold.end(), least);
      first[i] = static_cast<std::uint8_t>(above - threshold.begin());
    }
  }
  [[nodiscard]] std::uint8_t to_srgb(float value) const {
    const float inside = value > 0 ? std::min(value, 1.0F) : 0.0F;
    std::uint8_t result = first[static_cast<std::size_t>(inside * kCells)];
    while (result < 255 && threshold[result] <= value) ++result;
    return result;
  }
};

const SrgbTables& tables() {
  static const SrgbTables instance;
  return instance;
}

double catmull_rom(double x) {
  x = std::abs(x);
  if (x < 1) return (1.5 * x - 2.5) * x * x + 1;
  if (x < 2) return ((-0.5 * x + 2.5) * x - 4) * x + 2;
  return 0;
}
double tent(double x) {
  return std::max(0.0, 1 - std::abs(x));
}

/// The source samples of one sample of the result.
struct Taps {
  std::vector<std::uint32_t> index;
  std::vector<float> weight;
};

std::vector<Taps> plan(std::uint32_t from, std::uint32_t to, bool opaque, Wrap wrap) {
  const double step = static_cast<double>(from) / to;
  const double width = std::max(1.0, step);  // of one unit of the kernel, in source samples
  const double reach = (opaque ? 2.0 : 1.0) * width;
  std::vector<Taps> taps(to);
  for (std::uint32_t i = 0; i < to; ++i) {
    const double centre = (i + 0.5) * step - 0.5;
    const auto first = static_cast<std::int64_t>(std::ceil(centre - reach));
    const auto last = static_cast<std::int64_t>(std::floor(centre + reach));
    double sum = 0;
    std::vector<double> weights;
    for (std::int64_t k = first; k <= last; ++k) {
      const double x = (static_cast<double>(k) - centre) / width;
      weights.push_back(opaque ? catmull_rom(x) : tent(x));
      sum += weights.back();
      taps[i].index.push_back(static_cast<std::uint32_t>(wrapped(k, from, wrap)));
    }
    for (const double weight : weights) {
      taps[i].weight.push_back(static_cast<float>(weight / sum));
    }
  }
  return taps;
}

LinearImage resample_rows(const LinearImage& image, std::uint32_t height,
                          const ResampleOptions& options) {
  const std::vector<Taps> taps = plan(image.height, height, image.opaque, options.wrap[1]);
  const std::size_t stride = std::size_t{image.width} * 4;
  LinearImage out{image.width, height, image.opaque, std::vector<float>(stride * height)};
  parallel_rows(height, options.jobs, [&](std::uint32_t y) {
    float* to = &out.pixels[y * stride];
    for (std::size_t k = 0; k < taps[y].index.size(); ++k) {
      const float* from = &image.pixels[taps[y].index[k] * stride];
      const float weight = taps[y].weight[k];
      for (std::size_t i = 0; i < stride; ++i) to[i] += weight * from[i];
    }
  });
  return out;
}

/// One row filtered to taps.size() pixels, added to `to`.
void filter_row(const float* row, const std::vector<Taps>& taps, float* to) {
  for (const Taps& tap : taps) {
    for (std::size_t k = 0; k < tap.index.size(); ++k) {
      const float* from = row + std::size_t{tap.index[k]} * 4;
      for (std::size_t c = 0; c < 4; ++c) to[c] += tap.weight[k] * from[c];
    }
    to += 4;
  }
}

LinearImage resample_columns(const LinearImage& image, std::uint32_t width,
                             const ResampleOptions& options) {
  const std::vector<Taps> taps = plan(image.width, width, image.opaque, options.wrap[0]);
  LinearImage out{width, image.height, image.opaque,
                  std::vector<float>(std::size_t{width} * image.height * 4)};
  parallel_rows(image.height, options.jobs, [&](std::uint32_t y) {
    filter_row(&image.pixels[std::size_t{y} * image.width * 4], taps,
               &out.pixels[std::size_t{y} * width * 4]);
  });
  return out;
}

/// Pixels from 8 bits to linear light, and back; `count` numbers, four a pixel.
void to_linear(const std::uint8_t* from, std::size_t count, float* to) {
  const SrgbTables& table = tables();
  for (std::size_t i = 0; i < count; i += 4) {
    const std::uint8_t alpha = from[i + 3];
    const float weight = static_cast<float>(alpha) / 255 + LinearImage::kAlphaFloor;
    for (std::size_t c = 0; c < 3; ++c) to[i + c] = table.linear[from[i + c]] * weight;
    to[i + 3] = static_cast<float>(alpha) / 255;
  }
}
void to_srgb(const float* from, std::size_t count, std::uint8_t* to) {
  const SrgbTables& table = tables();
  for (std::size_t i = 0; i < count; i += 4) {
    const float alpha = std::clamp(from[i + 3], 0.0F, 1.0F);
    const float weight = alpha + LinearImage::kAlphaFloor;
    for (std::size_t c = 0; c < 3; ++c) to[i + c] = table.to_srgb(from[i + c] / weight);
    to[i + 3] = static_cast<std::uint8_t>(alpha * 255 + 0.5F);
  }
}

/// Rows [first, end) of a resized image, by way of the source rows that they need alone.
void resize_band(const RgbaImage& image, const std::vector<Taps>& rows,
                 const std::vector<Taps>& columns, std::uint32_t first, std::uint32_t end,
                 RgbaImage& out) {
  std::vector<std::uint32_t> needed;
  for (std::uint32_t y = first; y < end; ++y) {
    needed.insert(needed.end(), rows[y].index.begin(), rows[y].index.end());
  }
  std::sort(needed.begin(), needed.end());
  needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
  const std::size_t stride = std::size_t{image.width} * 4;
  std::vector<float> source(needed.size() * stride);
  for (std::size_t i = 0; i < needed.size(); ++i) {
    to_linear(&image.pixels[needed[i] * stride], stride, &source[i * stride]);
  }
  const std::size_t out_stride = std::size_t{out.width} * 4;
  std::vector<float> tall(stride);
  std::vector<float> small(out_stride);
  for (std::uint32_t y = first; y < end; ++y) {
    std::fill(tall.begin(), tall.end(), 0.0F);
    std::fill(small.begin(), small.end(), 0.0F);
    for (std::size_t k = 0; k < rows[y].index.size(); ++k) {
      const auto row = std::lower_bound(needed.begin(), needed.end(), rows[y].index[k]);
      const float* from = &source[static_cast<std::size_t>(row - needed.begin()) * stride];
      const float weight = rows[y].weight[k];
      for (std::size_t i = 0; i < stride; ++i) tall[i] += weight * from[i];
    }
    filter_row(tall.data(), columns, small.data());
    to_srgb(small.data(), out_stride, &out.pixels[y * out_stride]);
  }
}

}  // namespace

LinearImage to_linear(const RgbaImage& image) {
  LinearImage out{image.width, image.height, is_opaque(image),
                  std::vector<float>(image.pixels.size())};
  to_linear(image.pixels.data(), image.pixels.size(), out.pixels.data());
  return out;
}

RgbaImage to_srgb(const LinearImage& image) {
  RgbaImage out{image.width, image.height, std::vector<std::uint8_t>(image.pixels.size())};
  to_srgb(image.pixels.data(), image.pixels.size(), out.pixels.data());
  return out;
}

RgbaImage resize(const RgbaImage& image, std::uint32_t width, std::uint32_t height,
                 const ResampleOptions& options) {
  /// Rows of the result in a band. More convert fewer source rows twice, at bands' borders; fewer
  /// take less memory.
  constexpr std::uint32_t kBand = 16;
  const bool opaque = is_opaque(image);
  const std::vector<Taps> rows = plan(image.height, height, opaque, options.wrap[1]);
  const std::vector<Taps> columns = plan(image.width, width, opaque, options.wrap[0]);
  RgbaImage out{width, height, std::vector<std::uint8_t>(std::size_t{width} * height * 4)};
  parallel_rows((height + kBand - 1) / kBand, options.jobs, [&](std::uint32_t band) {
    resize_band(image, rows, columns, band * kBand, std::min(height, (band + 1) * kBand), out);
  });
  return out;
}

LinearImage resample(const LinearImage& image, std::uint32_t width, std::uint32_t height,
                     const ResampleOptions& options) {
  return resample_columns(resample_rows(image, height, options), width, options);
}

std::vector<RgbaImage> mip_chain(const RgbaImage& image, const TextureWrap& wrap, unsigned jobs) {
  std::vector<RgbaImage> levels = {image};
  if (image.width == 0 || image.height == 0) return levels;
  LinearImage level = to_linear(image);
  while (level.width > 1 || level.height > 1) {
    level = resample(level, std::max(1U, level.width / 2), std::max(1U, level.height / 2),
                     {wrap, jobs});
    levels.push_back(to_srgb(level));
  }
  return levels;
}

}  // namespace modar
