// From an image file to mip levels of compressed blocks, ready for glCompressedTexImage2D.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bake/report.hpp"
#include "bake/texture/texture_codec.hpp"
#include "formats/base/error.hpp"
#include "formats/sections.hpp"

namespace modar {

struct TextureLevel {
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

struct Texture {
  std::string name;  ///< file name without folder
  TextureFormat format = TextureFormat::kEtc1Rgb;
  std::uint32_t source_width = 0;
  std::uint32_t source_height = 0;
  std::uint32_t wrap = 0;  ///< as in TextureOptions
  bool alpha = false;
  bool cut_out =
      false;  ///< alpha is nearly everywhere 0 or 1: coarser levels keep the covered share
  /// All that is shown has one colour and alpha: `levels` is a single texel, and a material that
  /// multiplies itself with this colour needs no texture at all.
  bool constant = false;
  std::array<std::uint8_t, 4> constant_rgba{};
  std::vector<TextureLevel> levels;
};

struct TextureOptions {
  TextureFormat format = TextureFormat::kEtc1Rgb;
  std::uint32_t max_side = 2048;
  bool mipmaps = true;
  /// TextureFlags of a texture whose uvs leave [0,1]: kTextureRepeat and how; 0: none do. Sides
  /// become powers of two (ES 2.0 repeats and mips no others).
  std::uint32_t wrap = 0;
  unsigned jobs = 1;  ///< the bytes do not depend on it
  TextureEffort effort = TextureEffort::kGood;
  bool perceptual = false;  ///< see EncodeOptions
  /// Which texels the model shows (bake/texture/coverage.hpp), at any size; nothing: all of them.
  /// The others are filled, and blocks far from any are flat.
  const CoverageMask* coverage = nullptr;
  double min_psnr_db = 0;      ///< level 0 below it: diagnostic "texture.quality"; 0: no gate
  double min_ssim = 0;         ///< the same
  std::string picture_folder;  ///< quality_picture() of level 0 goes there as NAME.png; empty: none
};

struct TextureSize {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
};

/// Powers of two (each the nearest as a ratio) where the texture has mips or repeats, which OpenGL
/// ES 2.0 asks for; at most options.max_side.
TextureSize texture_size(TextureSize source, const TextureOptions& options);

/// Factor by which small images are enlarged that the format's blocks cannot represent, such as
/// palettes: each pixel becomes a block.
inline constexpr std::uint32_t kEnlarged = 4;
bool can_be_enlarged(TextureSize source, std::uint32_t max_side);

/// Reads, resizes to powers of two (nearest at or below where larger than max_side; mips on ES 2.0
/// want them), builds mips, encodes, decodes again and measures PSNR and SSIM. Errors: those of
/// read_image() and write_png(); kUsage "texture.max-side".
Result<Texture> bake_texture(const std::string& path, const TextureOptions& options,
                             Report& report);
/// The same from an image; `path` is what it is called.
Result<Texture> bake_texture(const RgbaImage& source, const std::string& path,
                             const TextureOptions& options, Report& report);

}  // namespace modar
