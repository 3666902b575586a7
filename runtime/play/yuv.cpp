// ITU-R BT.601 in 16-bit fixed point: the same bits on every machine.
#include "yuv.hpp"

#include <algorithm>
#include <utility>

namespace modar {
namespace {

constexpr int kShift = 16;
constexpr int fixed(double value) {
  return static_cast<int>(value * (1 << kShift) + 0.5);
}

/// R = y Y + rv V, G = y Y - gu U - gv V, B = y Y + bu U, with Y, U, V freed of their offsets.
struct Weights {
  int offset;
  int y;
  int rv;
  int gu;
  int gv;
  int bu;
};
constexpr Weights kFull = {0,           fixed(1.0), fixed(1.402), fixed(0.344136), fixed(0.714136),
                           fixed(1.772)};
constexpr double kVideoY = 255.0 / 219.0;
constexpr double kVideoC = 255.0 / 224.0;
constexpr Weights kVideo = {16,
                            fixed(kVideoY),
                            fixed(1.402 * kVideoC),
                            fixed(0.344136 * kVideoC),
                            fixed(0.714136 * kVideoC),
                            fixed(1.772 * kVideoC)};

std::uint8_t rounded(int value) {
  return static_cast<std::uint8_t>(std::clamp((value + (1 << (kShift - 1))) >> kShift, 0, 255));
}

/// Where a row's samples lie: pixel x has its chroma at chroma[(x >> shift) * step].
struct Row {
  const std::uint8_t* y;
  const std::uint8_t* u;
  const std::uint8_t* v;
  std::size_t y_step;
  std::size_t step;
  unsigned shift;
};

std::size_t half(int side) {
  return (static_cast<std::size_t>(side) + 1) / 2;
}

Row row_of(const YuvFormat& format, const std::uint8_t* bytes, int row) {
  const auto w = static_cast<std::size_t>(format.width);
  const auto h = static_cast<std::size_t>(format.height);
  const auto r = static_cast<std::size_t>(row);
  const std::uint8_t* y = bytes + r * w;
  const std::uint8_t* chroma = bytes + w * h;
  const std::size_t wide = half(format.width);
  switch (format.layout) {
    case YuvLayout::kI420: {
      const std::uint8_t* u = chroma + r / 2 * wide;
      return {y, u, u + wide * half(format.height), 1, 1, 1};
    }
    case YuvLayout::kNv12: {
      const std::uint8_t* pair = chroma + r / 2 * 2 * wide;
      return {y, pair, pair + 1, 1, 2, 1};
    }
    case YuvLayout::kNv21: {
      const std::uint8_t* pair = chroma + r / 2 * 2 * wide;
      return {y, pair + 1, pair, 1, 2, 1};
    }
    case YuvLayout::kI422: {
      const std::uint8_t* u = chroma + r * wide;
      return {y, u, u + wide * h, 1, 1, 1};
    }
    case YuvLayout::kYuyv: {
      const std::uint8_t* line = bytes + r * 4 * wide;
      return {line, line + 1, line + 3, 2, 4, 1};
    }
    case YuvLayout::kI444:
      return {y, chroma + r * w, chroma + (h + r) * w, 1, 1, 0};
    case YuvLayout::kGray:
      break;
  }
  return {y, nullptr, nullptr, 1, 0, 0};
}

void convert_luma(const Row& row, const Weights& weights, int width, std::uint8_t* gray) {
  for (int i = 0; i < width; ++i) {
    const auto x = static_cast<std::size_t>(i);
    gray[x] = rounded(weights.y * (row.y[x * row.y_step] - weights.offset));
  }
}

void convert_row(const Row& row, const Weights& weights, int width, std::uint8_t* rgb) {
  for (int i = 0; i < width; ++i) {
    const auto x = static_cast<std::size_t>(i);
    const int luma = weights.y * (row.y[x * row.y_step] - weights.offset);
    const std::size_t at = (x >> row.shift) * row.step;
    const int u = row.u == nullptr ? 0 : row.u[at] - 128;
    const int v = row.v == nullptr ? 0 : row.v[at] - 128;
    rgb[3 * x] = rounded(luma + weights.rv * v);
    rgb[3 * x + 1] = rounded(luma - weights.gu * u - weights.gv * v);
    rgb[3 * x + 2] = rounded(luma + weights.bu * u);
  }
}

/// How the renderer calls a layout; kRgb where it cannot draw it.
PictureFormat picture_format(YuvLayout layout) {
  switch (layout) {
    case YuvLayout::kNv21:
      return PictureFormat::kNv21;
    case YuvLayout::kNv12:
      return PictureFormat::kNv12;
    case YuvLayout::kI420:
      return PictureFormat::kI420;
    default:
      return PictureFormat::kRgb;
  }
}

YuvLayout layout_of(PictureFormat format) {
  if (format == PictureFormat::kNv21) return YuvLayout::kNv21;
  return format == PictureFormat::kNv12 ? YuvLayout::kNv12 : YuvLayout::kI420;
}

void set_size(Frame& frame, const YuvFormat& format) {
  frame.width = format.width;
  frame.height = format.height;
}

std::size_t pixels_of(const Frame& frame) {
  return static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
}

void fill_rgb(Frame& frame, const YuvFormat& format, std::span<const std::uint8_t> bytes) {
  frame.rgb.resize(3 * pixels_of(frame));
  const Weights& weights = format.full_range ? kFull : kVideo;
  const std::size_t stride = 3 * static_cast<std::size_t>(format.width);
  for (int row = 0; row < format.height; ++row) {
    convert_row(row_of(format, bytes.data(), row), weights, format.width,
                &frame.rgb[static_cast<std::size_t>(row) * stride]);
  }
}

void fill_gray(Frame& frame, const YuvFormat& format, std::span<const std::uint8_t> bytes) {
  frame.gray.resize(pixels_of(frame));
  const Weights& weights = format.full_range ? kFull : kVideo;
  const auto width = static_cast<std::size_t>(format.width);
  for (int row = 0; row < format.height; ++row) {
    convert_luma(row_of(format, bytes.data(), row), weights, format.width,
                 &frame.gray[static_cast<std::size_t>(row) * width]);
  }
}

}  // namespace

CameraPicture Frame::picture() const {
  CameraPicture picture;
  picture.format = format;
  picture.width = width;
  picture.height = height;
  picture.full_range = full_range;
  if (format == PictureFormat::kRgb) {
    picture.planes[0] = rgb.data();
    picture.strides[0] = std::ptrdiff_t{3} * width;
    return picture;
  }
  const bool pairs = format != PictureFormat::kI420;
  const std::size_t luma = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  picture.planes = {yuv.data(), yuv.data() + luma, pairs ? nullptr : yuv.data() + luma / 4 * 5};
  picture.strides = {width, pairs ? width : width / 2, pairs ? 0 : width / 2};
  return picture;
}

std::size_t frame_bytes(const YuvFormat& format) {
  const auto w = static_cast<std::size_t>(format.width);
  const auto h = static_cast<std::size_t>(format.height);
  switch (format.layout) {
    case YuvLayout::kI420:
    case YuvLayout::kNv12:
    case YuvLayout::kNv21:
      return w * h + 2 * half(format.width) * half(format.height);
    case YuvLayout::kI422:
      return w * h + 2 * half(format.width) * h;
    case YuvLayout::kYuyv:
      return 4 * half(format.width) * h;
    case YuvLayout::kI444:
      return 3 * w * h;
    case YuvLayout::kGray:
      break;
  }
  return w * h;
}

void fill_frame(Frame& frame, const YuvFormat& format, std::span<const std::uint8_t> bytes) {
  set_size(frame, format);
  frame.format = PictureFormat::kRgb;
  fill_rgb(frame, format, bytes);
  fill_gray(frame, format, bytes);
}

void take_frame(Frame& frame, const YuvFormat& format, std::vector<std::uint8_t>& bytes) {
  const PictureFormat drawn = picture_format(format.layout);
  if (drawn == PictureFormat::kRgb || format.width % 2 != 0 || format.height % 2 != 0) {
    fill_frame(frame, format, bytes);
    return;
  }
  set_size(frame, format);
  frame.format = drawn;
  frame.full_range = format.full_range;
  frame.rgb.clear();
  frame.gray.clear();
  if (!format.full_range) fill_gray(frame, format, bytes);
  std::swap(frame.yuv, bytes);
}

void make_rgb(Frame& frame) {
  if (frame.format == PictureFormat::kRgb || !frame.rgb.empty()) return;
  fill_rgb(frame, {layout_of(frame.format), frame.width, frame.height, frame.full_range},
           frame.yuv);
}

void gray_from_rgb(Frame& frame) {
  constexpr int kRed = fixed(0.299);
  constexpr int kGreen = fixed(0.587);
  constexpr int kBlue = (1 << kShift) - kRed - kGreen;
  frame.gray.resize(frame.rgb.size() / 3);
  for (std::size_t i = 0; i < frame.gray.size(); ++i) {
    frame.gray[i] = rounded(kRed * frame.rgb[3 * i] + kGreen * frame.rgb[3 * i + 1] +
                            kBlue * frame.rgb[3 * i + 2]);
  }
}

}  // namespace modar
