// Models placed as on their pattern, in a room without it: for the viewers that phones have.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/mat4x4.hpp>

#include "bake/export/model_file.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// The models of a pattern, in metres: y up, the pattern's middle at the origin, its plane the
/// ground. A pattern whose printed width is unknown has a largest side of 20 cm.
std::vector<RoomModel> models_in_room(const BundleView& bundle, std::uint32_t pattern);

/// The textures of the bundle, decoded, with their alpha.
std::vector<GlbImage> decoded_textures(const BundleView& bundle);

}  // namespace modar
