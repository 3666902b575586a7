// Speed and quality of the ETC1 encoder on given images, compared with Android's libetc1.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/base/error.hpp"

namespace modar {

/// One figure. Decibels: mean over the images of the RGB PSNR of the decoded centre crop. MPix/s:
/// one thread, processor time, the best of several runs. `reference` is libetc1's, 0 (and the ratio
/// 0) where this build lacks it.
struct Etc1BenchRow {
  std::string measure;  ///< "fast_db", "fast_mpix_s", "good_db", ... "best_mpix_s"
  double ours = 0;
  double reference = 0;
  double ratio = 0;  ///< ours / reference
};

/// Encodes the centre crop of each image (offset rounded down to a multiple of 4; crop 0, or more
/// than a side: all of that side, down to a multiple of 4) at the three efforts. Prints nothing.
/// Errors: those of read_image(); kUsage "bench.no-images", "bench.crop".
Result<std::vector<Etc1BenchRow>> bench_etc1(const std::vector<std::string>& files,
                                             std::uint32_t crop);

}  // namespace modar
