// Benches that are long enough for files of their own.
#pragma once

#include <vector>

#include "bake/commands/commands.hpp"
#include "bake/commands/json_output.hpp"
#include "formats/error.hpp"

namespace modar {

/// `modar bench pose`: a row a measure and band; the reference is the article's method. Values that
/// do not apply are not finite. Errors: kIo "bench.folder"; those of reading pictures and videos.
Result<std::vector<BenchRow>> bench_pose_rows(const PoseBenchCommand& command);

}  // namespace modar
