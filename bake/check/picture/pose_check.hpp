// Patterns of a bundle as the device's tracker finds them, in rendered views of known pose.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bake/bundle/bundle_builder.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"

namespace modar {

struct PoseCheckOptions {
  std::vector<PatternRequest> pictures;  ///< with their names
  int views = 8;                         ///< of each step of size and tilt
  int width = 1280;                      ///< of the frames, pixels
  int height = 720;
  std::uint64_t seed = 1;
  std::function<void(double done)> progress;  ///< may be empty
};

/// One step: views whose pattern has about that area (of its picture's) and tilt; a curved one is
/// turned about its axis instead.
struct PoseStep {
  double area = 1;
  double tilt_deg = 0;
  int views = 0;
  int right = 0;         ///< found, the four corners off by less than 5 pixels in the mean
  double corner_px = 0;  ///< means over the right ones
  double rotation_deg = 0;
  double translation_percent = 0;  ///< of the distance
};

struct PatternRange {
  std::string name;
  std::string method;  ///< "ours" or "paper"
  std::vector<PoseStep> steps;
  double area_low = 0;   ///< working range: at least 3 of 4 views are right, without a gap
  double area_high = 0;  ///< 0: no step works
  double tilt_deg = 0;   ///< greatest, at the picture's own size; -1: not even from the front
  double corner_px = 0;  ///< means over all right views
  double rotation_deg = 0;
  double translation_percent = 0;
};

/// Renders each pattern over a made background, with blur, noise and light of its own, and asks
/// the tracker: our pose loop where the bundle has its records, else the ModAR paper's method.
/// Reports POSE_RANGE where a pattern of its picture's size is missed from the front or at 30
/// degrees, and SOURCE_MISSING where its picture is missing. Errors: those of reading pictures and
/// of the trackers.
Result<std::vector<PatternRange>> check_poses(const BundleView& bundle,
                                              const PoseCheckOptions& options,
                                              const IssueSink& sink);

}  // namespace modar
