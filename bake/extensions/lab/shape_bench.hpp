// How well labels on bottles and cups are found and tracked, on frames of exact geometry.
#pragma once

#include <vector>

#include "bake/extensions/lab/pose_bench.hpp"

namespace modar {

/// Every pattern of the options on a cylinder and on a cone, each with an arc of 120 degrees, and
/// with the next five on a box: found from all sides up to 35 and up to 70 degrees about the axis,
/// tracked on a camera's way around it, and all of them looked for at once where none is
/// (clutter_frames). Rows of method "ours", where shown_px is the error in the mean of what faces
/// the camera: the corners count what the thing hides, too. Errors: those of baking and of the
/// tracker.
Result<std::vector<PoseBenchRow>> bench_shapes(const PoseBenchOptions& options,
                                               const std::string& only,
                                               const ProgressCallback& progress);

}  // namespace modar
