// Copies of models drawn in the article's ways, measured.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "modar/mapped_file.hpp"
#include "modar/render_bench.hpp"
#include "modar/renderer.hpp"

namespace modar {

enum Way : std::size_t {
  kIndexArrays,
  kIndexVbo,
  kInstancingArrays,
  kInstancingVbo,
  kInstancedArrays,
  kWays
};
inline constexpr std::array<const char*, kWays> kWayNames = {
    "index_arrays", "index_vbo", "instancing_arrays", "instancing_vbo", "instanced_arrays"};

/// One point of a curve; negative where it was not measured.
struct CurvePoint {
  double draw_calls = -1;
  double state_changes = -1;
  double bytes = -1;
  double wall_ms = -1;
  double cpu_ms = -1;
  double batch_bytes = -1;
};

/// Everything that one process draws with.
struct BenchStage {
  MappedFile file;
  std::unique_ptr<GlContext> context;
  GlCaps caps;
  BundleView bundle;
};

Result<BenchStage> open_stage(const std::string& path, const RenderBenchOptions& options);

/// The models of a bundle that have a curve.
std::vector<std::uint32_t> curve_models(const BundleView& bundle,
                                        const RenderBenchOptions& options);

/// Curves of these models, all ways and numbers of copies, in that order.
Result<std::vector<CurvePoint>> measure_curves(const BenchStage& stage,
                                               const RenderBenchOptions& options);

/// The same in a child process whose Mesa draws nothing; empty where that fails.
std::vector<CurvePoint> curves_without_drawing(const std::string& path,
                                               const RenderBenchOptions& options);

/// Milliseconds of a clock of the system.
double clock_ms(clockid_t clock);
/// Of values in any order; they are shuffled.
double median(std::vector<double>& values);

}  // namespace modar
