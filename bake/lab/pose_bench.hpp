// How well and how fast patterns are found and tracked on rendered frames of known pose: the
// paper's method and ours on the same frames, one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bake/pattern/pose_scene.hpp"
#include "bake/report.hpp"
#include "formats/error.hpp"

namespace modar {

struct PoseBenchOptions {
  std::vector<std::string> patterns;     ///< image files
  std::vector<std::string> backgrounds;  ///< image files
  int frames = 100;                      ///< a band and pattern
  int clutter_frames = 0;                ///< without a pattern, in all; 0: frames a pattern
  int width = 1280;
  int height = 720;
  std::uint32_t paper_set = 1;  ///< the ModAR paper's parameter set; 0: without the ModAR paper's method
  bool ours = true;
  int many = 50;  ///< bench_many(): patterns in the greatest bundle, 2 or more
  std::uint64_t seed = 1;
  std::vector<SceneBand> bands;  ///< empty: pose_bands()
};

/// One method on one band, over all patterns.
struct PoseBenchRow {
  std::string band;
  std::string method;     ///< "paper" or "ours"
  bool sequence = false;  ///< frames followed each other, and were tracked
  int frames = 0;
  int without_pattern = 0;  ///< of the frames
  int false_found = 0;      ///< recognitions in those
  int recognised = 0;       ///< recognitions in the others
  int right = 0;            ///< mean error of the four corners under 5 pixels
  double error_px = 0;      ///< median over the right ones
  double jitter_px = 0;     ///< tracking: rms change of the corners' error from frame to frame
  double ms = 0;            ///< thread-CPU milliseconds a frame, mean
  double stages_ms[4] = {0, 0, 0, 0};  ///< wall: detect, describe, match, homography
};

/// Pictures as backgrounds of frames of that size. Errors: those of read_image().
Result<std::vector<GrayPicture>> load_backgrounds(const std::vector<std::string>& paths, int width,
                                                  int height);

/// Detection: every frame stands for itself.
Result<std::vector<PoseBenchRow>> bench_detection(const PoseBenchOptions& options,
                                                  const ProgressCallback& progress);

/// Tracking: sequences of `frames` frames of a hand-held path. speed: 1 is a calm hand; blur:
/// pixels of motion blur for each pixel of motion.
Result<std::vector<PoseBenchRow>> bench_tracking(const PoseBenchOptions& options,
                                                 const std::string& name, double speed, double blur,
                                                 const ProgressCallback& progress);

/// A real video. truth: lines "frame ok ... x0 y0 x1 y1 x2 y2 x3 y3" parted by blanks, '#' starts
/// a comment, ok is 1 where the pattern shows and the last eight numbers are its corners; empty:
/// the video shows no pattern, and every recognition is false. pattern: its picture; empty:
/// pattern.png beside the video, else all patterns of the options at once.
struct VideoBench {
  std::string video;
  std::string truth;
  std::string pattern;
};

/// Tracking over a video, with a default camera. Errors: kIo "bench.video", kInvalidInput
/// "bench.truth".
Result<std::vector<PoseBenchRow>> bench_video(const PoseBenchOptions& options,
                                              const VideoBench& video,
                                              const ProgressCallback& progress);

}  // namespace modar
