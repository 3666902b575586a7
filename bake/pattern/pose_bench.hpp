// How well and how fast patterns are found and tracked on rendered frames of known pose: the
// article's method and ours on the same frames, one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bake/pattern/pose_scene.hpp"
#include "formats/error.hpp"

namespace modar {

struct PoseBenchOptions {
  std::vector<std::string> patterns;     ///< image files
  std::vector<std::string> backgrounds;  ///< image files
  int frames = 100;                      ///< a band and pattern
  int width = 1280;
  int height = 720;
  std::uint32_t paper_set = 1;  ///< the article's parameter set; 0: without the article's method
  bool ours = true;
  std::uint64_t seed = 1;
  std::vector<SceneBand> bands;  ///< empty: pose_bands()
};

/// One method on one band, over all patterns.
struct PoseBenchRow {
  std::string band;
  std::string method;  ///< "paper" or "ours"
  int frames = 0;
  int recognised = 0;    ///< on frames without the pattern: false recognitions
  int right = 0;         ///< mean error of the four corners under 5 pixels
  double error_px = 0;   ///< median over the right ones
  double jitter_px = 0;  ///< tracking: rms change of the corners' error from frame to frame
  double ms = 0;         ///< thread-CPU milliseconds a frame, mean
  double stages_ms[4] = {0, 0, 0, 0};  ///< wall: detect, describe, match, homography
};

using PoseBenchProgress = std::function<void(const std::string& what, double done)>;

/// Detection: every frame stands for itself.
Result<std::vector<PoseBenchRow>> bench_detection(const PoseBenchOptions& options,
                                                  const PoseBenchProgress& progress);

/// Tracking: sequences of `frames` frames of a hand-held path. speed: 1 is a calm hand; blur:
/// pixels of motion blur for each pixel of motion.
Result<std::vector<PoseBenchRow>> bench_tracking(const PoseBenchOptions& options, double speed,
                                                 double blur, const PoseBenchProgress& progress);

}  // namespace modar
