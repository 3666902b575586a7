// How far one picture is from another, such as a decoded texture from its source.
#pragma once

#include "bake/image/image.hpp"

namespace modar {

/// What psnr_db() answers for equal images, and never exceeds.
inline constexpr double kEqualPsnr = 99;

/// Mean over R, G, B; 99 where the images are equal.
double psnr_db(const RgbaImage& a, const RgbaImage& b);

/// Mean structural similarity of luma, 1 where equal; 0 where the sizes differ or there is no
/// pixel. Wang et al., "Image quality assessment: from error visibility to structural similarity",
/// 2004: 11x11 Gaussian window of sigma 1.5. Deviation: edge pixels are repeated, so that the small
/// levels of a mip chain have a value too.
double ssim(const RgbaImage& a, const RgbaImage& b);

/// The 4x4 block that differs most.
struct WorstBlock {
  std::uint32_t x = 0;  ///< of its top-left pixel
  std::uint32_t y = 0;
  double psnr_db = kEqualPsnr;
};
WorstBlock worst_block(const RgbaImage& a, const RgbaImage& b);

/// Source, decoded and eight times their difference side by side, for a person to look at.
RgbaImage quality_picture(const RgbaImage& source, const RgbaImage& decoded);

}  // namespace modar
