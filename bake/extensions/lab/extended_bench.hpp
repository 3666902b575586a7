// How well a pose follows from the surroundings while its pattern is not seen: rendered rooms with
// depth, and videos whose pattern is blanked.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/pose_bench.hpp"

namespace modar {

/// One kind of sequence, over all patterns; without and with a gyroscope.
struct ExtendedRow {
  std::string scene;
  bool gyroscope = false;
  int unseen = 0;           ///< frames whose pattern is hidden, out of view or blanked
  int followed = 0;         ///< of those, frames with a pose of the surroundings
  double position_pct = 0;  ///< error of the pattern's place by its distance, 95th percentile
  double rotation_deg = 0;  ///< error of the rotation, 95th percentile
  double worst_position_pct = 0;
  double worst_rotation_deg = 0;
  double seen_px = 0;     ///< mean error of the corners where the loop without `extended` shows the
  double direct_px = 0;   ///< pattern, 95th percentile; and that loop's; 0: not measured
  double jump_px = 0;     ///< on return: of a corner in the frame, beyond its true way
  double honest_pct = 0;  ///< followed frames whose errors are within two stated deviations
  double ms = 0;          ///< thread-CPU milliseconds of such a frame, mean
};

/// For each pattern and scene a sequence of `frames` frames at most, 30 a second: the camera turns
/// by 60 degrees and back while it moves half a pattern's width (`turned`); something covers the
/// pattern (`covered`); the same with a passer-by (`passer-by`); one who may fill the frame, at any
/// speed (`filled by passer-by`, and `... while turned`); something slides to and fro over a part
/// of the pattern (`partly covered`); the pattern is carried through the room before a still
/// camera, then hidden, where any pose is wrong
/// (`carried`). Turns and covers take five seconds. only: scenes whose name holds it. Errors: those
/// of reading pictures, baking and the tracker.
Result<std::vector<ExtendedRow>> bench_extended(const PoseBenchOptions& options,
                                                const std::string& only,
                                                const ProgressCallback& progress);

/// A real video whose pattern is blanked in its second third, against the poses with it seen (which
/// are no truth); of the pattern VideoBench::pattern, or pattern.png next to it. Errors: kIo
/// "bench.video"; those of reading pictures, baking and the tracker.
Result<ExtendedRow> bench_extended_video(const VideoBench& video);

}  // namespace modar
