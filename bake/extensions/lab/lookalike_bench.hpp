// What tells a print from its lookalikes while it moves: other editions of a series, covered
// prints.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/pose_bench.hpp"

namespace modar {

/// Percentage of the sequences of a kind.
struct LookalikeRow {
  std::string measure;
  double percent = 0;
  int sequences = 0;
};

/// Sequences of 60 frames of a moving hand, options.frames of each kind and pattern:
/// "lookalike shown": another photo in the same layout, another language, the mirror image, with
/// the pattern alone in the bundle, in the last of these frames; "lookalike misnamed": pattern and
/// edition in the bundle, one of them shown, the other one reported in the fifth frame or later;
/// "covered right": half of the pattern behind something that stands still, right in the last
/// frame, and "plain right". And families of which one member was baked, of the frames after two
/// seconds: "shown", of the other member; "hidden", of the true one, taken for another print:
/// plain, held by thumbs, and covered by 20 to 60 %. only: "family": these alone. Errors: as of
/// bench_detection().
Result<std::vector<LookalikeRow>> bench_lookalikes(const PoseBenchOptions& options,
                                                   const std::string& only,
                                                   const ProgressCallback& progress);

}  // namespace modar
