// libFuzzer target: any bytes as a Y4M file, and as headerless frames, give frames of one size, or
// a coded error.
#include <cstddef>
#include <cstdint>

#include "runtime/play/raw_source.hpp"
#include "tests/fuzz/input_file.hpp"
#include "tests/fuzz/need.hpp"

namespace {

using namespace modar;
using test::need;

/// More bytes than a header of a few letters may ask for in a fuzzer.
constexpr std::size_t kMaxFrame = 1u << 22;

void play(const std::string& input) {
  const auto source = open_raw_source(input);
  if (!source) return test::need_told(source.error());
  need((*source)->info().fps > 0);
  Frame frame;
  for (std::uint64_t i = 0; i < 64; ++i) {
    const Result<bool> more = (*source)->next(frame);
    if (!more) return test::need_told(more.error());
    if (!*more) return;
    const auto pixels =
        static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
    need(pixels > 0 && frame.index == i);
    need(frame.format == PictureFormat::kRgb ? frame.rgb.size() == 3 * pixels
                                             : frame.yuv.size() == pixels + pixels / 2);
    need(frame.gray.empty() ? frame.format != PictureFormat::kRgb : frame.gray.size() == pixels);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static test::InputFile file("fuzz.y4m");
  const std::string& path = file.write(data, size);
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const Result<RawInput> header = parse_y4m_header(text.substr(0, text.find('\n')));
  if (!header || frame_bytes(header->format) <= kMaxFrame) play(path);
  for (const char* format : {"nv21:5x3@30:", "nv12:4x4:", "i420:3x2:", "yuyv:6x1:", "grey:7x1:"}) {
    play(format + path);
  }
  return 0;
}
