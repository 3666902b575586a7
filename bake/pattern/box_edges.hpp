// Pictures of a box's sides that were cut off their edges, corrected by the print that continues
// over these edges.
#pragma once

#include <array>

#include "bake/pattern/shape.hpp"

namespace modar {

/// Pictures of a box as of assemble_box(), and how far from their sides' edges they were cut.
struct CorrectedBox {
  std::array<GrayPicture, 6> pictures;
  double most = 0;      ///< share of a side's length by which an edge was moved; 0: none was
  bool beyond = false;  ///< an edge is further off than is corrected
};

/// Compares what two pictures show along the edge that their sides share, and moves the edges of
/// pictures by up to 3 % of a side so that print that runs over them meets. Pictures stay unchanged
/// if no print crosses edges, or all of it meets.
CorrectedBox correct_crops(const std::array<GrayPicture, 6>& pictures);

}  // namespace modar
