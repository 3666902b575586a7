// What the bake and the score of a pattern share: features of rendered views, brought back to the
// picture.
#pragma once

#include <array>
#include <cstdint>

#include "bake/pattern/view_render.hpp"
#include "modar/tracker_features.hpp"

namespace modar {

using TrackerCode = std::array<std::uint8_t, 32>;

/// Picture coordinates of a place in a view.
std::array<double, 2> to_picture(const AffineView& view, double x, double y);

/// Every corner that could be one of a pattern's, where a frame's search takes the best alone.
DetectOptions generous_detection();

}  // namespace modar
