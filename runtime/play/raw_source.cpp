// Conversions by ITU-R BT.601; headers of Y4M; frames from a file or a pipe.
#include "raw_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

#include "decimal.hpp"
#include "pipeline.hpp"

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

/// The places of a row's samples: pixel x has its chroma at chroma[(x >> shift) * step].
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

/// Layouts that the renderer draws, and how it calls them.
constexpr std::array<std::pair<YuvLayout, PictureFormat>, 3> kDrawn = {
    {{YuvLayout::kNv21, PictureFormat::kNv21},
     {YuvLayout::kNv12, PictureFormat::kNv12},
     {YuvLayout::kI420, PictureFormat::kI420}}};

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
  const auto* drawn =
      std::ranges::find(kDrawn, format.layout, &decltype(kDrawn)::value_type::first);
  if (drawn == kDrawn.end() || format.width % 2 != 0 || format.height % 2 != 0) {
    fill_frame(frame, format, bytes);
    return;
  }
  set_size(frame, format);
  frame.format = drawn->second;
  frame.full_range = format.full_range;
  frame.rgb.clear();
  frame.gray.clear();
  if (!format.full_range) fill_gray(frame, format, bytes);
  std::swap(frame.yuv, bytes);
}

void make_rgb(Frame& frame) {
  if (frame.format == PictureFormat::kRgb || !frame.rgb.empty()) return;
  const auto* drawn =
      std::ranges::find(kDrawn, frame.format, &decltype(kDrawn)::value_type::second);
  fill_rgb(frame, {drawn->first, frame.width, frame.height, frame.full_range}, frame.yuv);
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

namespace {

constexpr int kMaxSide =
    8192;  ///< pixels: larger than any camera; bounds what a damaged header allocates

struct Named {
  std::string_view name;
  YuvLayout layout;
  bool full_range;
};
/// Android hands out NV21 in full range; the others come from video.
constexpr std::array<Named, 5> kHeaderless = {{{"nv21", YuvLayout::kNv21, true},
                                               {"nv12", YuvLayout::kNv12, false},
                                               {"i420", YuvLayout::kI420, false},
                                               {"yuyv", YuvLayout::kYuyv, false},
                                               {"grey", YuvLayout::kGray, true}}};
/// Y4M's colour spaces of 8 bits (the C tag); where chroma sits within a pixel is left aside.
constexpr std::array<Named, 7> kY4m = {{{"420", YuvLayout::kI420, false},
                                        {"420jpeg", YuvLayout::kI420, false},
                                        {"420mpeg2", YuvLayout::kI420, false},
                                        {"420paldv", YuvLayout::kI420, false},
                                        {"422", YuvLayout::kI422, false},
                                        {"444", YuvLayout::kI444, false},
                                        {"mono", YuvLayout::kGray, false}}};

const Named* find(std::span<const Named> table, std::string_view name) {
  for (const Named& named : table) {
    if (named.name == name) return &named;
  }
  return nullptr;
}

bool read_number(std::string_view text, int& value) {
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && last == end;
}

bool good_side(int side) {
  return side >= 1 && side <= kMaxSide;
}

/// "30", "29.97" or "30000:1001" by `separator`.
bool read_rate(std::string_view text, char separator, double& fps) {
  const std::size_t split = text.find(separator);
  double over = 1;
  double rate = 0;
  if (!parse_decimal(text.substr(0, split), rate)) return false;
  if (split != std::string_view::npos && !parse_decimal(text.substr(split + 1), over)) return false;
  rate /= over;
  if (!(rate > 0 && rate <= 1000)) return false;
  fps = rate;
  return true;
}

tl::unexpected<Error> bad_header(std::string cause) {
  return fail(ExitCode::kInvalidInput, "input.y4m", "", std::move(cause),
              "write it with ffmpeg -pix_fmt yuv420p -f yuv4mpegpipe");
}

Result<void> read_tag(RawInput& raw, std::string_view tag) {
  const std::string_view value = tag.substr(1);
  switch (tag[0]) {
    case 'W':
      if (!read_number(value, raw.format.width)) return bad_header("its width is not a number");
      break;
    case 'H':
      if (!read_number(value, raw.format.height)) return bad_header("its height is not a number");
      break;
    case 'F':
      // 0:0 means an unknown rate.
      if (value != "0:0" && !read_rate(value, ':', raw.fps)) return bad_header("it has no rate");
      break;
    case 'C': {
      const Named* named = find(kY4m, value);
      if (named == nullptr) {
        return fail(ExitCode::kUnsupported, "input.y4m", "",
                    "its colour space " + std::string(value) + " is not read",
                    "write it with ffmpeg -pix_fmt yuv420p -f yuv4mpegpipe");
      }
      raw.format.layout = named->layout;
      break;
    }
    case 'X':
      if (value == "COLORRANGE=FULL") raw.format.full_range = true;
      break;
    default:
      break;  // interlacing and pixel aspect change nothing here
  }
  return {};
}

class RawSource final : public FrameSource {
 public:
  RawSource(int descriptor, std::string name) : descriptor_(descriptor), name_(std::move(name)) {}
  ~RawSource() override {
    if (descriptor_ != STDIN_FILENO) close(descriptor_);
  }

  /// Reads the header of Y4M; knows the count of frames where the file's size gives it.
  Result<void> begin(const RawInput& raw) {
    raw_ = raw;
    std::size_t head = 0;
    if (raw.y4m) {
      std::string line;
      MODAR_TRY(read_line(line));
      Result<RawInput> header = parse_y4m_header(line);
      if (!header) {
        header.error().where = name_;
        return tl::unexpected(header.error());
      }
      raw_.format = header->format;
      raw_.fps = header->fps;
      head = line.size() + 1;
    }
    bytes_.resize(frame_bytes(raw_.format));
    info_.fps = raw_.fps;
    struct stat status {};
    if (fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode)) {
      const std::size_t each = bytes_.size() + (raw.y4m ? std::strlen("FRAME\n") : 0);
      info_.frames = (static_cast<std::size_t>(status.st_size) - head) / each;
    }
    return {};
  }

  [[nodiscard]] SourceInfo info() const override { return info_; }

  Result<bool> next(Frame& frame) override {
    if (raw_.y4m) {
      std::string line;
      MODAR_ASSIGN(const bool more, read_line(line));
      if (!more) return false;
      if (line != "FRAME" && !line.starts_with("FRAME ")) {
        return fail(ExitCode::kInvalidInput, "input.y4m", name_,
                    "frame " + std::to_string(next_) + " does not start with FRAME",
                    "the header's size or colour space is not that of its frames");
      }
    }
    bytes_.resize(frame_bytes(raw_.format));  // the frame's old buffer may be in its place
    MODAR_ASSIGN(const std::size_t got, read_some({bytes_.data(), bytes_.size()}));
    if (stopped_ || (got == 0 && !raw_.y4m)) return false;
    if (got < bytes_.size()) {
      return fail(ExitCode::kInvalidInput, "input.truncated", name_,
                  "frame " + std::to_string(next_) + " ends after " + std::to_string(got) + " of " +
                      std::to_string(bytes_.size()) + " bytes",
                  "check the size that was given, or the program that writes them");
    }
    take_frame(frame, raw_.format, bytes_);
    frame.index = next_;
    frame.time_s = static_cast<double>(next_) / raw_.fps;
    ++next_;
    return true;
  }

  void stop() override { wake_.stop(); }

 private:
  /// As many bytes as there are until the end, at most the span's.
  Result<std::size_t> read_some(std::span<std::uint8_t> bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
      if (wake_.wait(descriptor_) == WakeEvent::Event::kStopped) {
        stopped_ = true;
        break;
      }
      const ssize_t got = read(descriptor_, bytes.data() + done, bytes.size() - done);
      if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (got < 0) {
        return fail(ExitCode::kIo, "input.read", name_, std::strerror(errno), "check the device");
      }
      if (got == 0) break;
      done += static_cast<std::size_t>(got);
    }
    return done;
  }

  /// Up to the newline, which is left out. False at the end of the file.
  Result<bool> read_line(std::string& line) {
    constexpr std::size_t kMaxLine = 256;
    for (;;) {
      std::uint8_t letter = 0;
      MODAR_ASSIGN(const std::size_t got, read_some({&letter, 1}));
      if (got == 0 && line.empty()) return false;
      if (got == 0 || line.size() == kMaxLine) {
        return fail(ExitCode::kInvalidInput, "input.y4m", name_, "a header line does not end",
                    "this is not a Y4M file");
      }
      if (letter == '\n') return true;
      line += static_cast<char>(letter);
    }
  }

  int descriptor_;
  std::string name_;
  RawInput raw_;
  SourceInfo info_;
  std::vector<std::uint8_t> bytes_;
  std::uint64_t next_ = 0;
  bool stopped_ = false;
  WakeEvent wake_;
};

}  // namespace

bool is_raw_input(std::string_view input) {
  if (input == "-" || input.ends_with(".y4m") || input.starts_with("y4m:")) return true;
  const std::size_t colon = input.find(':');
  return colon != std::string_view::npos && find(kHeaderless, input.substr(0, colon)) != nullptr;
}

Result<RawInput> parse_raw_input(const std::string& input) {
  RawInput raw;
  const std::string_view text = input;
  const std::size_t colon = text.find(':');
  const Named* named =
      colon == std::string::npos ? nullptr : find(kHeaderless, text.substr(0, colon));
  if (named == nullptr) {
    raw.y4m = true;
    raw.path = input.starts_with("y4m:") ? input.substr(4) : input;
    return raw;
  }
  const std::size_t second = text.find(':', colon + 1);
  const std::string_view size = text.substr(colon + 1, second - colon - 1);
  const std::size_t x = size.find('x');
  const std::size_t at = size.find('@');
  const bool shaped = second != std::string::npos && x != std::string::npos && x < at;
  const bool good = shaped && read_number(size.substr(0, x), raw.format.width) &&
                    read_number(size.substr(x + 1, at == std::string::npos ? at : at - x - 1),
                                raw.format.height) &&
                    (at == std::string::npos || read_rate(size.substr(at + 1), '/', raw.fps)) &&
                    good_side(raw.format.width) && good_side(raw.format.height) &&
                    second + 1 < text.size();
  if (!good) {
    return fail(ExitCode::kUsage, "input.raw", input, "that names no raw frames",
                "write it like nv21:640x480@30:frames.raw, or nv21:640x480:- for a pipe");
  }
  raw.format.layout = named->layout;
  raw.format.full_range = named->full_range;
  raw.path = input.substr(second + 1);
  return raw;
}

Result<RawInput> parse_y4m_header(std::string_view line) {
  constexpr std::string_view kMagic4 = "YUV4MPEG2";
  if (!line.starts_with(kMagic4)) return bad_header("it does not start with YUV4MPEG2");
  RawInput raw;
  raw.y4m = true;
  for (std::size_t at = kMagic4.size(); at < line.size();) {
    if (line[at] == ' ') {
      ++at;
      continue;
    }
    const std::size_t end = std::min(line.find(' ', at), line.size());
    MODAR_TRY(read_tag(raw, line.substr(at, end - at)));
    at = end;
  }
  if (!good_side(raw.format.width) || !good_side(raw.format.height)) {
    return bad_header("its sides are not from 1 to 8192 pixels");
  }
  return raw;
}

Result<std::unique_ptr<FrameSource>> open_raw_source(const std::string& input) {
  // Explicitly: GCC 12 takes a move out of this Result for a use of an unset value.
  const Result<RawInput> raw = parse_raw_input(input);
  if (!raw) return tl::unexpected<Error>(raw.error());
  const int descriptor =
      raw->path == "-" ? STDIN_FILENO : open(raw->path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return fail(ExitCode::kIo, "input.open", raw->path,
                std::string("it cannot be opened: ") + std::strerror(errno), "check the path");
  }
  auto source = std::make_unique<RawSource>(descriptor, raw->path);
  MODAR_TRY(source->begin(*raw));
  return source;
}

}  // namespace modar
