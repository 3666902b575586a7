// PKM around ETC1 blocks, KTX 1 around those of any format.
#include "bake/export/texture_files.hpp"

#include <string_view>

#include "formats/texture_format.hpp"

namespace modar {
namespace {

class ByteWriter {
 public:
  void text(std::string_view bytes) {
    for (const char c : bytes) out_.push_back(static_cast<std::byte>(c));
  }
  void big16(std::uint32_t value) {
    out_.push_back(static_cast<std::byte>(value >> 8 & 0xff));
    out_.push_back(static_cast<std::byte>(value & 0xff));
  }
  void little32(std::uint64_t value) {
    for (unsigned shift = 0; shift < 32; shift += 8) {
      out_.push_back(static_cast<std::byte>(value >> shift & 0xff));
    }
  }
  void bytes(std::span<const std::byte> in) { out_.insert(out_.end(), in.begin(), in.end()); }
  std::vector<std::byte> take() { return std::move(out_); }

 private:
  std::vector<std::byte> out_;
};

constexpr std::uint32_t kGlRgb = 0x1907;

}  // namespace

std::vector<std::byte> to_pkm(std::span<const std::byte> blocks, std::uint32_t width,
                              std::uint32_t height) {
  ByteWriter out;
  out.text("PKM 10");
  out.big16(0);  // ETC1_RGB_NO_MIPMAPS
  out.big16((width + 3) / 4 * 4);
  out.big16((height + 3) / 4 * 4);
  out.big16(width);
  out.big16(height);
  out.bytes(blocks);
  return out.take();
}

std::vector<std::byte> to_ktx(TextureFormat format, std::span<const KtxLevel> levels) {
  using std::string_view_literals::operator""sv;
  ByteWriter out;
  out.text("\xABKTX 11\xBB\r\n\x1A\n"sv);
  out.little32(0x04030201);  // as the writer of the file counts bytes
  out.little32(0);           // glType: compressed
  out.little32(1);           // glTypeSize
  out.little32(0);           // glFormat: compressed
  out.little32(find_texture_format(static_cast<std::uint32_t>(format))->gl_format);
  out.little32(kGlRgb);
  out.little32(levels.empty() ? 0 : levels.front().width);
  out.little32(levels.empty() ? 0 : levels.front().height);
  out.little32(0);  // depth
  out.little32(0);  // array elements
  out.little32(1);  // faces
  out.little32(levels.size());
  out.little32(0);  // bytes of key-value pairs
  for (const KtxLevel& level : levels) {
    out.little32(level.blocks.size());
    out.bytes(level.blocks);  // a multiple of 8: no padding
  }
  return out.take();
}

}  // namespace modar
