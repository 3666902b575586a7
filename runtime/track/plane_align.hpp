// Moves a pose until the pattern's patches lie on the frame, and tells how well they do. Internal
// to runtime/track.
#pragma once

#include <span>

#include "loop_pattern.hpp"
#include "modar/camera.hpp"
#include "modar/pose.hpp"
#include "plane_map.hpp"

namespace modar::loop {

/// How a pattern's patches fit the frame.
struct Fit {
  int visible = 0;  ///< patches that project into the frame
  int held = 0;     ///< of those, patches that correlate well
  int level = 0;    ///< pyramid level that was looked at
  [[nodiscard]] double share() const { return visible > 0 ? 1.0 * held / visible : 0.0; }
  [[nodiscard]] bool good() const { return held >= 6 && held * 10 >= visible * 3; }
};

/// The finest pyramid level on which the pattern's image is not magnified, and the level of the
/// pattern's image that has the frame's resolution there.
struct Resolution {
  int frame_level = 0;
  int pattern_level = 0;
};
Resolution finest(const LoopPattern& pattern, const PlaneMap& map, int frame_levels);

/// Gauss-Newton on the pose over all patches of the pattern's level that fits `frame_level`: each
/// patch has its own gain and bias and is weighted by its correlation (Tukey). The source of the
/// idea: Baker & Matthews, "Lucas-Kanade 20 years on" (2004). Stops early where the pose settles.
Fit align(const LoopPattern& pattern, const Camera& camera, std::span<const GrayImage> pyramid,
          int frame_level, int steps, Pose& pose);

/// Share of the pattern's textured cells (of 8x8) inside the frame that correlate with it, 0 to 1,
/// and how many they are.
struct Verdict {
  int cells = 0;
  int right = 0;
};
Verdict verify(const LoopPattern& pattern, const PlaneMap& map, std::span<const GrayImage> pyramid);

}  // namespace modar::loop
