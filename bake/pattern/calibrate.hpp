// `modar calibrate`: a camera's intrinsics from pictures of a chessboard, or of any pattern that
// can be baked.
#pragma once

#include <string>
#include <vector>

#include "bake/pattern/shape.hpp"
#include "bake/report.hpp"
#include "formats/base/error.hpp"
#include "modar/camera.hpp"

namespace modar {

struct CalibrateOptions {
  std::vector<std::string> inputs;  ///< image files and videos, all of one size
  int board_columns = 0;            ///< inner corners of the chessboard; 0: the plane is a pattern
  int board_rows = 0;
  std::string pattern;  ///< picture, or bundle whose first pattern it is
  ShapeRequest shape;   ///< of a picture
  /// Views used, spread evenly over those that show the plane: twice as many would have 0.7 of the
  /// noise, and take eight times as long to solve.
  int most_views = 40;
};

struct Calibration {
  Camera camera;
  int frames = 0;                        ///< examined
  int views = 0;                         ///< in which board or pattern was found and used
  double rms_px = 0;                     ///< reprojection error over all points
  double focal_spread = 0;               ///< standard deviation of the focal length, pixels
  bool principal_point_assumed = false;  ///< in the middle, since all views tilt about one axis
};

/// Finds board or pattern in each frame and calibrates from the plane's views (Zhang, "A flexible
/// new technique for camera calibration", 2000, as OpenCV has it). From a board: fx, fy, cx, cy and
/// k1 k2 p1 p2 k3; from a pattern: one focal length for both axes, cx, cy and k1 k2, and the
/// print's aspect; its focal_spread is not below that of thirds of the views. Errors: kIo
/// "calibrate.input"; kInvalidInput "calibrate.size" (frames of different sizes),
/// "calibrate.few-views" (fewer than 5 views), "calibrate.weak" (views too similar to determine the
/// focal length to 3 %, or all tilted to the same side); those of reading pictures and of the
/// tracker.
Result<Calibration> calibrate(const CalibrateOptions& options, const ProgressCallback& progress);

/// The camera as OpenCV's YML, for modar-play --camera. Errors: those of write_file().
Result<void> write_camera_file(const Calibration& calibration, const std::string& path);

}  // namespace modar
