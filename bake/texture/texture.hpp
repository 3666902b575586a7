// From an image file to mip levels of ETC1 blocks, ready for glCompressedTexImage2D.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "bake/report.hpp"
#include "formats/error.hpp"

namespace modar {

/// Time against quality; `modar bench etc1` measures both.
enum class Etc1Effort : std::uint8_t { kFast, kGood, kBest };

struct Etc1Options {
  Etc1Effort effort = Etc1Effort::kGood;
  bool perceptual = false;  ///< minimise errors weighted like luma; else those of RGB alike
  unsigned jobs = 1;        ///< threads; the bytes do not depend on it
};

/// ETC1 blocks of an image, 8 bytes a block in rows of ceil(width/4) blocks; edge pixels are
/// repeated to fill blocks. Alpha is ignored. out: ceil(w/4) * ceil(h/4) * 8 bytes, the same on
/// every processor.
std::vector<std::byte> encode_etc1(const RgbaImage& image, const Etc1Options& options = {});
/// Its inverse (alpha = 255). blocks.size() as above.
RgbaImage decode_etc1(std::span<const std::byte> blocks, std::uint32_t width, std::uint32_t height);

struct Etc1Level {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::byte> colour;
  std::vector<std::byte> alpha;  ///< twin image, empty where alpha is constant 255
  double psnr_db = 0;
  double ssim = 0;
  std::uint32_t worst_x = 0;  ///< top-left pixel of the block that differs most from the source
  std::uint32_t worst_y = 0;
  double worst_psnr_db = 0;
};

struct CoverageMask;

struct Etc1Texture {
  std::string name;  ///< file name without folder
  std::uint32_t source_width = 0;
  std::uint32_t source_height = 0;
  bool repeat = false;
  bool alpha = false;
  /// All that is shown has one colour and alpha: `levels` is a single texel, and a material that
  /// multiplies itself with this colour needs no texture at all.
  bool constant = false;
  std::array<std::uint8_t, 4> constant_rgba{};
  std::vector<Etc1Level> levels;
};

struct TextureOptions {
  std::uint32_t max_side = 2048;
  bool mipmaps = true;
  bool repeat = false;  ///< sides become powers of two (ES 2.0 repeats and mips no others)
  unsigned jobs = 1;    ///< the bytes do not depend on it
  Etc1Effort effort = Etc1Effort::kGood;
  bool perceptual = false;  ///< see Etc1Options
  /// Which texels the model shows (bake/texture/atlas.hpp), at any size; nothing: all of them. The
  /// others are filled, and blocks far from any are flat.
  const CoverageMask* coverage = nullptr;
  double min_psnr_db = 0;      ///< level 0 below it: diagnostic "texture.quality"; 0: no gate
  double min_ssim = 0;         ///< the same
  std::string picture_folder;  ///< quality_picture() of level 0 goes there as NAME.png; empty: none
};

/// Reads, resizes to powers of two (nearest at or below where larger than max_side; mips on ES 2.0
/// want them), builds mips, encodes, decodes again and measures PSNR and SSIM. Errors: those of
/// read_image() and write_png(); kUsage "texture.max-side".
Result<Etc1Texture> bake_texture(const std::string& path, const TextureOptions& options,
                                 Report& report);

}  // namespace modar
