// The door of the lab: benches, each a set of figures compared with a reference that was measured
// in the same run. Mutation of bundles has a door of its own, mutate.hpp.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "formats/base/error.hpp"
#include "formats/layout.hpp"

namespace modar {

/// `modar-lab bench pose`.
struct PoseBenchRequest {
  std::string patterns;       ///< a folder of pictures, or one
  std::string backgrounds;    ///< the same
  std::string video;          ///< empty: none
  std::string truth;          ///< CSV of the video's corners; empty: it shows no pattern
  std::string video_pattern;  ///< picture of what the video shows; empty: see VideoBench
  std::string parameters =
      kDefaultParameterSet;   ///< set of the ModAR paper's method; "none": ours alone
  std::string only;           ///< bands whose name holds this text
  int frames = 100;           ///< a band and pattern
  int clutter = 0;            ///< frames without a pattern, in all; 0: as the others
  bool tables = false;        ///< print the ModAR paper's tables instead
  bool scores = false;        ///< hold scores against working ranges instead
  bool field = false;         ///< phones' conditions instead: blur, noise, glare, bend
  bool shape = false;         ///< labels on bottles and cups instead
  bool copies = false;        ///< clutter: phantom copies of the print in view instead
  bool lookalikes = false;    ///< sequences of lookalike and covered prints instead
  std::string path;           ///< replay this camera path instead; see bench_path()
  bool sift = false;          ///< also OpenCV's SIFT with MAGSAC
  bool known_camera = false;  ///< the tracker knows lens and aspect
  int held = 1;               ///< frames for which each view is held and tracked
  int many = 0;               ///< measure bundles of 1 to this many patterns instead
  unsigned seed = 1;
  bool quiet = false;
};

/// `modar-lab bench model`.
struct ModelBenchRequest {
  std::string obj;    ///< measured unchanged; empty: one is made from the input scan
  bool big = false;   ///< made at the size of the ModAR paper's CHURCH
  unsigned jobs = 1;  ///< of our own runs
};

struct BenchOptions {
  std::string name;
  std::vector<std::string> inputs;
  unsigned crop = 0;   ///< etc1: side of the centre crop in pixels, 0: whole images
  std::string output;  ///< light: folder for pictures; empty: none are written
  std::string light;   ///< light: a panorama; empty: a room that is made
  std::string device;  ///< render: profile that masks the context; empty: none
  PoseBenchRequest pose;
  ModelBenchRequest model;
  bool json = false;  ///< no progress either
};

/// In the place of a figure that does not apply.
inline constexpr double kNoFigure = std::numeric_limits<double>::quiet_NaN();

/// A figure and its reference; what does not apply is not finite.
struct BenchRow {
  std::string measure;
  double ours = 0;
  double reference = 0;
  double ratio = 0;
};

/// Runs the bench of that name, with progress on stderr. Errors: kUsage "bench.unknown" that lists
/// the benches, kUsage "bench.inputs"; those of the bench.
Result<std::vector<BenchRow>> run_bench(const BenchOptions& options);

}  // namespace modar
