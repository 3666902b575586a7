// What bundles cost on the way, compared with Draco on the whole model, meshoptimizer's codecs and
// zstd.
#pragma once

#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// The bench's rows have other names in the commands; ours and the reference in the measure's unit.
struct ShipBenchRow {
  std::string measure;
  double ours = 0;
  double reference = 0;
};

/// files: bundles, or models, which are baked with the default options. Errors: kInvalidInput
/// "bench.bake"; those of opening bundles and of make_recipe().
Result<std::vector<ShipBenchRow>> bench_ship(const std::vector<std::string>& files, unsigned jobs);

/// A model as one Draco mesh, quantised by Draco itself: the reference for geometry.
struct DracoPeer {
  int position_bits = 0;  ///< the fewest with which the rms error is not above the bundle's
  std::size_t bytes = 0;
  double decode_s = 0;  ///< of one thread's CPU time
};
/// Normals at 9 bits (as exact as 3 signed bytes), uv at 16. Level 0 of the model's chunks.
DracoPeer encode_with_draco(const BundleView& bundle, std::uint32_t model);

}  // namespace modar
