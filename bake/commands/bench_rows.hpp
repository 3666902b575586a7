// Benches that are long enough for files of their own.
#pragma once

#include <string>
#include <vector>

#include "bake/commands/commands.hpp"
#include "bake/commands/json_output.hpp"
#include "formats/error.hpp"

namespace modar {

/// `modar bench pose`: a row a measure and band; the reference is the article's method. Values that
/// do not apply are not finite. Errors: kIo "bench.folder"; those of reading pictures and videos.
Result<std::vector<BenchRow>> bench_pose_rows(const PoseBenchCommand& command);

/// `modar bench model`: reading and baking a large OBJ beside other programs, each measurement in a
/// process of its own. A reference that this machine lacks is not finite. Errors: kUsage
/// "bench.inputs"; kUnsupported "bench.probe" where modar-model-probe does not lie beside
/// modar-workshop; those of making the file.
Result<std::vector<BenchRow>> bench_model_rows(const std::vector<std::string>& scans,
                                               const ModelBenchCommand& command);

}  // namespace modar
