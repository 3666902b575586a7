// The pose loop on videos of real things, compared with SIFT, ORB and the ModAR paper's method.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/bench.hpp"
#include "bake/pattern/pattern.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"

namespace modar {

struct WildBenchOptions {
  std::string folder;                      ///< see find_wild_clips()
  std::string only;                        ///< clips whose name holds this text
  std::vector<std::string> more_patterns;  ///< pictures to look for in clips that show none
  /// Of the ModAR paper's method; 0: neither that nor the other methods run.
  std::uint32_t paper_set = 1;
  TrackerRecordOptions bake;
};

/// Plays each clip with the default camera, which the loop estimates, as people do who set nothing.
/// Other methods see only the frames that are judged, each on its own. Rows "WHAT CLIP", and
/// "WHAT CLIP beside METHOD" with that method's figure as the reference:
/// - shown_pct: of frames with a truth; shown_frames: of all (the reference);
/// - error_px, p95_px: mean distance of the corners from the truth, median and 95th percentile,
///   pixels of a frame whose longer side has 640; pose_px, pose_p95_px: of the outline that the
///   pose and the estimated camera draw; drawn_px, drawn_p95_px: with Detection::stretch, as models
///   are drawn;
/// - extended shown_pct, p95_px: with PoseLoopOptions::extended; the reference is without it;
/// - hidden REASON: frames with a truth in which nothing is shown;
/// - P@5, P@15 of published clips: share of the judged frames whose corners' root of the mean
///   square distance is at most this many pixels, as percent; their means over clips at the end;
/// - false_frames: of clips without a truth, compared with their number of frames.
/// Errors: those of find_wild_clips(), of reading pictures and videos and of baking.
Result<std::vector<BenchRow>> bench_wild(const WildBenchOptions& options,
                                         const ProgressCallback& progress);

}  // namespace modar
