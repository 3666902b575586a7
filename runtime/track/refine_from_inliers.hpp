// From features of a part of a pattern to a pose that holds for all of it. Internal to
// runtime/track.
#pragma once

#include "plane_align.hpp"

namespace modar::tracker {

/// Root mean square of what a pose leaves of the points, in their sigmas.
double misfit(const Camera& camera, const Pose& pose, const PlanePoints& points);

/// Moves the pose by the points and by the patches whose place they tell to a pixel or so. Each
/// that is found there tells its own place better than features do, and so where the patches beyond
/// it lie: what shows of a pattern is taken up from where its features are.
void grow(const TrackedPattern& pattern, const Scene& scene, const PlanePoints& points, Pose& pose);

}  // namespace modar::tracker
