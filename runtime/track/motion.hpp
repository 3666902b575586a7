// Where a pattern is expected next. Internal to runtime/track.
#pragma once

#include "plane_map.hpp"

namespace modar::tracker {

/// The pose that continues the motion from `before` to `now`.
Pose continued(const Pose& before, const Pose& now);

/// Whether the frame can show more than a fringe of the pattern.
bool in_view(const TrackedPattern& pattern, const PlaneMap& map, const Camera& camera);

}  // namespace modar::tracker
