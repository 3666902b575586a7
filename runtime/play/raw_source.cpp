// Reads raw frames with read() and poll(): no library, so that the device's build has them too.
#include "raw_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "decimal.hpp"
#include "wake.hpp"

namespace modar {
namespace {

constexpr int kMaxSide = 8192;

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
      if (!read_number(value, raw.format.width)) return bad_header("its width is no number");
      break;
    case 'H':
      if (!read_number(value, raw.format.height)) return bad_header("its height is no number");
      break;
    case 'F':
      // 0:0 stands for an unknown rate.
      if (value != "0:0" && !read_rate(value, ':', raw.fps)) return bad_header("its rate is none");
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

  /// Reads the header of Y4M; knows the count of frames where the file's size tells it.
  Result<void> begin(const RawInput& raw) {
    raw_ = raw;
    std::size_t head = 0;
    if (raw.y4m) {
      std::string line;
      if (auto read = read_line(line); !read) return tl::unexpected(read.error());
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
      const Result<bool> more = read_line(line);
      if (!more) return tl::unexpected(more.error());
      if (!*more) return false;
      if (line != "FRAME" && !line.starts_with("FRAME ")) {
        return fail(ExitCode::kInvalidInput, "input.y4m", name_,
                    "frame " + std::to_string(next_) + " does not start with FRAME",
                    "the header's size or colour space is not that of its frames");
      }
    }
    bytes_.resize(frame_bytes(raw_.format));  // the frame's old buffer may be in its place
    const Result<std::size_t> got = read_some({bytes_.data(), bytes_.size()});
    if (!got) return tl::unexpected(got.error());
    if (stopped_ || (*got == 0 && !raw_.y4m)) return false;
    if (*got < bytes_.size()) {
      return fail(ExitCode::kInvalidInput, "input.truncated", name_,
                  "frame " + std::to_string(next_) + " ends after " + std::to_string(*got) +
                      " of " + std::to_string(bytes_.size()) + " bytes",
                  "check the size that was told, or the program that writes them");
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
      if (wake_.wait(descriptor_) == Wake::Event::kStopped) {
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
      const Result<std::size_t> got = read_some({&letter, 1});
      if (!got) return tl::unexpected(got.error());
      if (*got == 0 && line.empty()) return false;
      if (*got == 0 || line.size() == kMaxLine) {
        return fail(ExitCode::kInvalidInput, "input.y4m", name_, "a header line does not end",
                    "this is no Y4M");
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
  Wake wake_;
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
    if (auto read = read_tag(raw, line.substr(at, end - at)); !read) {
      return tl::unexpected(read.error());
    }
    at = end;
  }
  if (!good_side(raw.format.width) || !good_side(raw.format.height)) {
    return bad_header("its sides are not from 1 to 8192 pixels");
  }
  return raw;
}

Result<std::unique_ptr<FrameSource>> open_raw_source(const std::string& input) {
  const Result<RawInput> raw = parse_raw_input(input);
  if (!raw) return tl::unexpected(raw.error());
  const int descriptor =
      raw->path == "-" ? STDIN_FILENO : open(raw->path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return fail(ExitCode::kIo, "input.open", raw->path,
                std::string("it cannot be opened: ") + std::strerror(errno), "check the path");
  }
  auto source = std::make_unique<RawSource>(descriptor, raw->path);
  if (auto begun = source->begin(*raw); !begun) return tl::unexpected(begun.error());
  return source;
}

}  // namespace modar
