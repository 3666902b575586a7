// Blocks of one colour, which need no search.
#pragma once

#include <cstdint>

namespace modar {

/// The best block for sixteen pixels of one colour (red in the lowest byte, then green, blue), as
/// the number whose most significant byte GL reads first. perceptual: weights 3:6:1, else equal
/// ones.
std::uint64_t encode_solid_etc1(std::uint32_t rgb, bool perceptual);

}  // namespace modar
