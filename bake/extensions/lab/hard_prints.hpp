// Prints that much else looks like: regular ones, fine ones, soft ones.
#pragma once

#include <string>
#include <vector>

#include "bake/pattern/pattern.hpp"

namespace modar {

struct HardPrint {
  std::string kind;  ///< "chessboard", "marker sheet", ...
  GrayPicture picture;
};

/// Two prints of each of 15 kinds, with other counts, contents and proportions for every seed.
std::vector<HardPrint> hard_prints(Random& random);

}  // namespace modar
