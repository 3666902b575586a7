// A picture of a room as the light that it gives.
#pragma once

#include <string>

#include "formats/base/error.hpp"
#include "formats/layout.hpp"

namespace modar {

/// Reads a Radiance HDR or any other image as a view all around (equirectangular: its top row is
/// the ceiling, its middle column is behind the pattern, in its +y) and sums up what it gives:
/// nine coefficients, and the brightest spot as the key light. What it gives a surface that looks
/// up is scaled to what the neutral room gives, so that only its colours and directions count. A
/// photo that shows a part of a room serves as well: ceiling above, floor below. Leaves `scene` at
/// 0. Errors: those of read_linear_image(); kInvalidInput "light.black".
Result<LightRecord> read_light(const std::string& path);

}  // namespace modar
