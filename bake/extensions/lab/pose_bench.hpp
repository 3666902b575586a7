// How well and how fast patterns are detected and tracked on rendered frames of known pose: the
// ModAR paper's method and ours on the same frames, single-threaded.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "bake/pattern/pattern.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"

namespace modar {

/// The bands of the ModAR paper's experiments and beyond, as bench tables print them.
std::vector<SceneBand> pose_bands();

struct PoseBenchOptions {
  std::vector<std::string> patterns;     ///< image files
  std::vector<std::string> backgrounds;  ///< image files
  int frames = 100;                      ///< of each band and pattern
  int clutter_frames = 0;  ///< without a pattern, in all; 0: `frames` for each pattern
  int width = 1280;
  int height = 720;
  std::uint32_t paper_set = 1;  ///< parameter set of the paper's method; 0: without that method
  bool ours = true;
  bool sift = false;  ///< also OpenCV's SIFT with MAGSAC
  /// Frames are rendered through the camera that the tracker is given, and show the unchanged
  /// picture; false: as draw_unknown() has them, and the tracker estimates the camera.
  bool known_camera = false;
  /// bench_detection(): ours: frames for which each view is held and tracked, each with noise
  /// of its own; the last one counts. 1: single frames.
  int held = 1;
  int many = 50;  ///< bench_many(): patterns in the greatest bundle, 2 or more
  std::uint64_t seed = 1;
  std::vector<SceneBand> bands;  ///< empty: pose_bands()
};

/// The least and the most of the samples; equal bounds of 0 where nothing was.
struct IntRange {
  int least = 0;
  int most = 0;
  bool any = false;
  void take(int value) {
    least = any ? std::min(least, value) : value;
    most = any ? std::max(most, value) : value;
    any = true;
  }
};

/// One method on one band, over all patterns.
struct PoseBenchRow : PoseFigures {
  std::string band;
  std::string method;                  ///< "paper", "ours" or "sift"
  bool sequence = false;               ///< frames followed each other and were tracked
  bool detailed = false;               ///< P@5 and P@15 are printed, too
  double shown_px = 0;                 ///< of curved patterns: see bench_shapes(); 0: not measured
  int beside = 0;                      ///< of curved patterns: frames that show a pose so far off
  double ms = 0;                       ///< thread-CPU milliseconds of a frame, mean
  double stages_ms[4] = {0, 0, 0, 0};  ///< wall time: detect, describe, match, homography
  IntRange features;                   ///< of a frame
  IntRange inliers;                    ///< of a recognition
};

/// Detection: frames are independent.
Result<std::vector<PoseBenchRow>> bench_detection(const PoseBenchOptions& options,
                                                  const ProgressCallback& progress);

/// A hand-held path.
struct BenchPath {
  const char* name;
  double speed;   ///< 1: a calm hand
  double blur;    ///< pixels of motion blur for each pixel of motion
  double tremor;  ///< see HandPath
};
/// Tracking: sequences of `frames` frames of a path.
Result<std::vector<PoseBenchRow>> bench_tracking(const PoseBenchOptions& options,
                                                 const BenchPath& path,
                                                 const ProgressCallback& progress);

/// Detection under each of field_conditions() whose name, after "field ", holds `only`.
Result<std::vector<PoseBenchRow>> bench_field(const PoseBenchOptions& options,
                                              const std::string& only,
                                              const ProgressCallback& progress);

/// Tracking along a recorded camera path: a text file with a line for each frame, of 9 numbers (a
/// homography from the picture's pixels to the frame's, row by row) or 12 (a pose: rotation row by
/// row, then translation in half pattern widths), separated by blanks or commas; '#' starts a
/// comment. Every pattern replays it. Errors: kIo, kInvalidInput "bench.path".
Result<std::vector<PoseBenchRow>> bench_path(const PoseBenchOptions& options,
                                             const std::string& path,
                                             const ProgressCallback& progress);

/// A real video.
struct VideoBench {
  std::string video;
  /// Lines "frame ok ... x0 y0 x1 y1 x2 y2 x3 y3" separated by blanks; '#' starts a comment, ok is
  /// 1 where the pattern shows, and the last eight numbers are its corners. Empty: the video shows
  /// no pattern, and every recognition is false.
  std::string truth;
  /// Its picture; empty: pattern.png next to the video, else all patterns of the options at once.
  std::string pattern;
};

/// Tracking over a video, with a default camera. Errors: kIo "bench.video", kInvalidInput
/// "bench.truth".
Result<std::vector<PoseBenchRow>> bench_video(const PoseBenchOptions& options,
                                              const VideoBench& video,
                                              const ProgressCallback& progress);

}  // namespace modar
