// The colours of a pattern, which tell the light on it: a section since 1.2.
#pragma once

#include <cstdint>

#include "formats/layout.hpp"

namespace modar {

inline constexpr std::uint32_t kMaxColourCells = 16;  ///< across and down

/// Mean colours of the picture's cells follow, columns * rows of them: red, green, blue, each 16
/// bits, linear with 65535 as 1, first row at the top.
struct ColourGridHeader {
  std::uint32_t columns;  ///< 1 to kMaxColourCells
  std::uint32_t rows;
  std::uint32_t reserved[2];
};
static_assert(sizeof(ColourGridHeader) == 16);

}  // namespace modar
