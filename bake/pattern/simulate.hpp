// `modar pattern simulate`: how far, how tilted, how dark, how blurred a pattern may be for the
// device's own loop.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "bake/lab/pose_bench.hpp"
#include "bake/pattern/view_trial.hpp"
#include "formats/error.hpp"
#include "modar/camera.hpp"

namespace modar {

struct SimulateOptions {
  Camera camera = default_camera(1280, 720);  ///< frames have its size
  std::vector<std::string> backgrounds;       ///< image files; empty: made ones
  int views = 10;                             ///< of each value of a band
  double width_mm = 0;                        ///< printed; 0: what the file states
  std::uint64_t seed = 1;
  unsigned jobs = 1;  ///< threads; what comes out does not depend on it
};

/// One value of a band, say "tilt 60", and what became of its views.
struct SimulatedValue {
  double value = 0;
  TrialOutcome outcome;
};

/// One thing that varies, the others staying easy.
struct SimulatedBand {
  std::string name;  ///< "distance", "tilt", "rotation", "blur", "light", "noise", "occlusion"
  std::string unit;  ///< "widths" (of the pattern), "degrees", "pixels", ...
  std::vector<SimulatedValue> values;
};

/// Where at least nine of ten frames are right, without a gap. Zeros: nowhere.
struct WorkingRange {
  double nearest = 0;   ///< widths of the pattern
  double farthest = 0;  ///< the same
  double tilt_deg = 0;
};

struct Simulation {
  std::string name;     ///< the file's
  double width_mm = 0;  ///< 0: unknown
  std::vector<SimulatedBand> bands;
  WorkingRange range;
};

/// Errors: those of reading pictures, baking the pattern and the loop; kUsage "simulate.camera" (a
/// camera without a size).
Result<Simulation> simulate(const std::string& path, const SimulateOptions& options,
                            const ProgressCallback& progress);

/// "printed 20 cm wide, it is recognised from 15 cm to 1.6 m and up to 62 degrees": the words after
/// the pattern's name.
std::string range_sentence(const Simulation& simulation);

/// A row a band, a column a value: its first view with the outline of the truth (white) and what
/// was seen (green where right, else red), and the share of right frames.
RgbaImage simulation_picture(const Simulation& simulation);

}  // namespace modar
