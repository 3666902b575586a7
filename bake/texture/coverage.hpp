// Which texels of a texture a model shows, and what becomes of the others.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bake/texture/texture.hpp"

namespace modar {

/// One byte a texel, top row first: not 0 where some triangle shows it.
struct CoverageMask {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> covered;  ///< width * height
  bool full = false;                  ///< known to be covered everywhere
  std::uint64_t marked = 0;           ///< texels, with repetition, since `full` was looked at
};

CoverageMask make_coverage(std::uint32_t width, std::uint32_t height);

/// Marks every texel whose square a triangle touches. uv: three corners, v upwards as in OBJ files
/// (0 is the bottom row's lower edge); parts beyond [0,1] wrap around. A triangle that spans more
/// than four repeats marks its bounding box; one that is not finite, everything.
void cover_triangle(CoverageMask& mask, const std::array<std::array<double, 2>, 3>& uv);

/// The mask at another size: a texel is covered where any part of it was.
CoverageMask resize_coverage(const CoverageMask& mask, std::uint32_t width, std::uint32_t height);

/// Fills texels that are not covered with the colours around them, nearest levels of a pyramid
/// first (pull-push, Gortler et al., "The Lumigraph", 1996), so that no filter mixes in texels that
/// no triangle shows. mask has the image's size; one without any covered texel changes nothing.
void fill_uncovered(RgbaImage& image, const CoverageMask& mask);

/// Gives texels of alpha 0 the colours around them, weighted by alpha, in the same way: hidden
/// colours reach visible texels through mips and through the blocks that they share. An image
/// without any visible texel stays unchanged.
void fill_transparent(RgbaImage& image);

/// Paints blocks of 4x4 texels that are more than one texel away from all covered texels in the
/// mean colour of those: they all become the same 8 bytes.
void flatten_uncovered_blocks(RgbaImage& image, const CoverageMask& mask);

}  // namespace modar
