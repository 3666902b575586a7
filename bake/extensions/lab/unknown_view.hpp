// What neither the maker of a pattern nor the tracker knows: the visitor's lens, and how far the
// print's sides differ from the picture's.
#pragma once

#include "bake/pattern/pattern.hpp"
#include "modar/camera.hpp"
#include "modar/image.hpp"

namespace modar {

struct UnknownView {
  Camera lens;        ///< that frames are rendered through
  GrayPicture print;  ///< that they show
};

/// Draws a lens and a print. Focal lengths are between 0.65 and 1.2 of the longer side, as those of
/// four clips from other people's phones (0.63, 0.99, 1.10, 1.10); k1 within +-0.05, what a phone
/// leaves of its lens in a video; the print is up to 4 % wider or narrower than the picture, as
/// handheld photos make it. known: `assumed` and the picture unchanged; nothing is drawn.
UnknownView draw_unknown(const GrayImage& picture, const Camera& assumed, bool known,
                         Random& random);

}  // namespace modar
