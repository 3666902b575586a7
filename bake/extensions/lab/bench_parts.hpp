// Internal to bake/extensions/lab: the benches that are long enough for files of their own.
#pragma once

#include <string>
#include <vector>

#include "bake/extensions/lab/bench.hpp"
#include "bake/extensions/lab/play_json.hpp"
#include "bake/extensions/lab/pose_bench.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// a / b, kNoFigure where b is not positive.
inline double ratio(double a, double b) {
  return b > 0 ? a / b : kNoFigure;
}

/// The ModAR paper's parameter set of that name, 0: "none". Errors: kUsage "parameters.unknown".
Result<std::uint32_t> paper_set_named(const std::string& name);

/// `modar-lab bench pose`: a row a measure and band; the reference is the ModAR paper's method.
/// Values that do not apply are not finite. Errors: kIo "pictures.folder"; those of reading
/// pictures and videos.
Result<std::vector<BenchRow>> bench_pose_rows(const PoseBenchRequest& command);

/// `modar-lab bench model`: reading and baking a large OBJ compared with other programs, each
/// measurement in a process of its own. A reference that this machine lacks is not finite. Errors:
/// kUsage "bench.inputs"; kUnsupported "bench.probe" where modar-model-probe is not next
/// to modar; those of making the file.
Result<std::vector<BenchRow>> bench_model_rows(const std::vector<std::string>& scans,
                                               const ModelBenchRequest& command);

/// `modar-lab bench pose --tables`: the ModAR paper's Tables 6 to 8 and its statements of accuracy
/// (reference) with its method and ours on these frames ("ours" is measured here; of
/// Tables 7 and 8 the reference is a phone). Errors: those of bench_detection().
Result<std::vector<BenchRow>> paper_rows(const PoseBenchOptions& options,
                                         const ProgressCallback& progress);

/// `modar-lab bench render BUNDLE... --video FILE`: the ModAR paper's Table 9 (reference) compared
/// with the player, which runs the video at its own speed, headless, in a process of its own.
/// Errors: those of MappedFile and BundleView; kUsage "bench.scene"; kIo and kInvalidInput
/// "bench.play".
Result<std::vector<BenchRow>> bench_display_rows(const BenchOptions& command);

/// Its rows of one run. model: decides which of the ModAR paper's columns is the reference; of
/// others the reference is not finite.
std::vector<BenchRow> display_rows(const std::string& model, const PlayedRun& run);

}  // namespace modar
