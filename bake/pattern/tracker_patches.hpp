// Places of a pattern whose texture holds a position, level by level.
#pragma once

#include <cstdint>
#include <vector>

#include "bake/pattern/view_render.hpp"
#include "formats/tracker_record.hpp"

namespace modar {

/// At most `count` patches a level, spread over the picture, by level and then by score.
std::vector<TrackerPatchRecord> choose_patches(const std::vector<ViewLevel>& levels,
                                               std::uint32_t count);

}  // namespace modar
