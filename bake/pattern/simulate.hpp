// `modar pattern simulate`: how far, tilted, dark or blurred a pattern may be for the device's
// tracker.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake/image/image.hpp"
#include "bake/pattern/trial.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"
#include "modar/camera.hpp"

namespace modar {

struct SimulateOptions {
  Camera camera = default_camera(1280, 720);  ///< frames have its size
  std::vector<std::string> backgrounds;       ///< image files; empty: generated ones
  int views = 10;                             ///< of each value of a band
  double width_mm = 0;                        ///< printed; 0: what the file or the shape states
  ShapeRequest shape;  ///< what it is printed on; flat where nothing is stated
  std::uint64_t seed = 1;
  unsigned jobs = 1;  ///< threads; the outcome does not depend on it
};

/// One value of a band, say a tilt of 60 degrees, and the outcome of its views.
struct SimulatedValue {
  double value = 0;
  TrialOutcome outcome;
};

/// One condition that varies while the others stay easy.
struct SimulatedBand {
  /// "distance", "tilt", "around" (of curved ones), "rotation", "blur", "light", "noise",
  /// "occlusion"
  std::string name;
  std::string unit;  ///< "widths" (of the pattern), "degrees", "pixels", ...
  std::vector<SimulatedValue> values;
};

/// The range in which, and at whose ends, at least nine of ten frames are right. Zeros: none.
struct WorkingRange {
  double nearest = 0;   ///< widths of the pattern
  double farthest = 0;  ///< the same
  double tilt_deg = 0;
  double around_deg = 0;  ///< of curved patterns, to either side
};

struct Simulation {
  std::string name;     ///< the file's
  double width_mm = 0;  ///< 0: unknown
  bool curved = false;
  std::vector<SimulatedBand> bands;
  WorkingRange range;
};

/// Errors: those of reading pictures, of baking the pattern and of the tracker; kUsage
/// "simulate.camera" (a camera without a size).
Result<Simulation> simulate(const std::string& path, const SimulateOptions& options,
                            const ProgressCallback& progress);

/// The longest ranges; tilt and around begin at 0.
WorkingRange range_of(const std::vector<SimulatedBand>& bands);

/// "printed 20 cm wide, this camera recognises it from 15 cm to 1.6 m and up to 62 degrees".
std::string range_sentence(const Simulation& simulation);

/// A contact sheet: a row for each band, a column for each value, which shows its first view with
/// the true outline (white), the detected one where it is right (green), and the share of right
/// frames.
RgbaImage simulation_picture(const Simulation& simulation);

}  // namespace modar
