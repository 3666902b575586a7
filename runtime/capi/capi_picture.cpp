// modar.h: camera frames as gray pictures, and smaller ones. Nothing of the tracker and of the
// renderer.
#include <algorithm>
#include <array>
#include <vector>

#include "runtime/capi/handles.hpp"
#include "runtime/capi/picture.hpp"

namespace {

/// Luma of video (16 to 235) as 0 to 255.
std::array<std::uint8_t, 256> widened_luma() {
  std::array<std::uint8_t, 256> full{};
  for (int i = 0; i < 256; ++i) {
    const int value = ((i - 16) * static_cast<int>(255.0 / 219.0 * 65536 + 0.5) + 32768) >> 16;
    full[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::clamp(value, 0, 255));
  }
  return full;
}

/// By the weights of BT.601, which sum to 1 << 16 here.
std::uint8_t gray_of(const std::uint8_t* rgb) {
  return static_cast<std::uint8_t>((19595 * rgb[0] + 38470 * rgb[1] + 7471 * rgb[2] + 32768) >> 16);
}

}  // namespace

int modar_gray(const modar_picture* picture, uint8_t* gray, modar_error* error) {
  if (picture == nullptr || gray == nullptr) {
    return modar::set_error(modar::missing(picture == nullptr ? "picture" : "gray"), error);
  }
  const modar_picture asked = modar::grown(*picture);
  if (const auto valid = modar::check_picture(asked); !valid) {
    return modar::set_error(valid.error(), error);
  }
  const bool colour = asked.format == MODAR_RGB || asked.format == MODAR_RGBA;
  const std::size_t pixel = !colour ? 1 : asked.format == MODAR_RGB ? 3 : 4;
  const auto width = static_cast<std::size_t>(asked.width);
  const std::array<std::uint8_t, 256> full = widened_luma();
  for (int y = 0; y < asked.height; ++y) {
    const std::uint8_t* const row = asked.planes[0] + asked.strides[0] * y;
    std::uint8_t* const out = gray + width * static_cast<std::size_t>(y);
    for (std::size_t x = 0; x < width; ++x) {
      const std::uint8_t* const at = row + pixel * x;
      out[x] = colour ? gray_of(at) : asked.full_range != 0 ? *at : full[*at];
    }
  }
  return MODAR_OK;
}

void modar_shrink(const uint8_t* gray, size_t stride, int width, int height, int factor,
                  uint8_t* out) {
  if (gray == nullptr || out == nullptr || factor < 1 || factor > 256) return;
  const auto side = static_cast<std::size_t>(factor);
  const auto columns = static_cast<std::size_t>(std::max(width, 0)) / side;
  const auto rows = static_cast<std::size_t>(std::max(height, 0)) / side;
  // Of `factor` pixels one above the other, at most 256 * 255.
  std::vector<std::uint16_t> sums(columns * side);
  const std::uint32_t area = static_cast<std::uint32_t>(side * side);
  for (std::size_t y = 0; y < rows; ++y) {
    std::fill(sums.begin(), sums.end(), std::uint16_t{0});
    for (std::size_t k = 0; k < side; ++k) {
      const std::uint8_t* const row = gray + (y * side + k) * stride;
      for (std::size_t x = 0; x < sums.size(); ++x) {
        sums[x] = static_cast<std::uint16_t>(sums[x] + row[x]);
      }
    }
    for (std::size_t x = 0; x < columns; ++x) {
      std::uint32_t sum = area / 2;
      for (std::size_t k = 0; k < side; ++k) sum += sums[x * side + k];
      out[y * columns + x] = static_cast<std::uint8_t>(sum / area);
    }
  }
}

double modar_brightness(const uint8_t* gray, size_t stride, int width, int height) {
  if (gray == nullptr) return 0;
  constexpr int kStep = 16;
  double sum = 0;
  int count = 0;
  for (int y = 0; y < height; y += kStep) {
    const uint8_t* row = gray + stride * static_cast<size_t>(y);
    for (int x = 0; x < width; x += kStep, ++count) sum += row[x];
  }
  return count == 0 ? 0 : sum / count;
}
