// Moves a pose until the pattern's patches lie on the frame, and tells how well they do. Internal
// to runtime/track.
#pragma once

#include <span>

#include "modar/camera.hpp"
#include "modar/pose.hpp"
#include "patch_cache.hpp"
#include "plane_map.hpp"
#include "tracked_pattern.hpp"

namespace modar::tracker {

/// How a pattern's patches fit the frame.
struct Fit {
  int visible = 0;      ///< patches that project into the frame
  int held = 0;         ///< of those, patches that correlate well
  int level = 0;        ///< pyramid level that was looked at
  double likeness = 0;  ///< mean correlation of the visible patches
  [[nodiscard]] double share() const { return visible > 0 ? 1.0 * held / visible : 0.0; }
  /// Of many patches fewer need hold: most may lie in the half that something hides.
  [[nodiscard]] bool good() const {
    return held >= 6 && (held * 10 >= visible * 3 || (held >= 30 && held * 5 >= visible));
  }
};

/// The finest pyramid level on which the pattern's image is not magnified, and the level of the
/// pattern's image that has the frame's resolution there.
struct Resolution {
  int frame_level = 0;
  int pattern_level = 0;
};
Resolution finest(const TrackedPattern& pattern, const PlaneMap& map, int frame_levels);

/// How the picture is smeared: each point by this share of its way from where `before` saw it. A
/// template that is smeared alike meets its picture without the pull that blur has on a sharp one
/// (after Park, Lepetit & Woo, "Handling motion-blur in 3D tracking and rendering for augmented
/// reality", 2012).
struct Smear {
  Pose before;
  double share = 0;  ///< 0 to 1
};

/// A frame as the camera's pyramid, and what looking at it needs.
struct Scene {
  const Camera& camera;
  std::span<const GrayImage> pyramid;
  const Kernels& kernels;
  PatchCache& patches;
  const Smear* smear = nullptr;  ///< null: sharp
};

/// Gauss-Newton on the pose over patches of the pattern's level that fits `frame_level`: each patch
/// has its own gain and bias and is weighted by its correlation (Tukey). The source of the idea:
/// Baker & Matthews, "Lucas-Kanade 20 years on" (2004). Up to `steps` over some of the patches,
/// fewer where the pose settles; then one more, or where precise, up to three over all of them.
Fit align(const TrackedPattern& pattern, const Scene& scene, int frame_level, int steps,
          bool precise, Pose& pose);

/// How the patches fit at a pose.
Fit look(const TrackedPattern& pattern, const Scene& scene, int frame_level, const Pose& pose);

/// The same over the eight parameters of the plane's own map: for a pattern that no pose of the
/// camera explains. The change of a pixel by the lens is taken as straight.
Fit align_map(const TrackedPattern& pattern, const Scene& scene, int frame_level, int steps,
              PlaneMap& map);

/// Share of the pattern's textured cells (of 8x8) inside the frame that correlate with it, 0 to 1,
/// and how many they are.
struct Verdict {
  int cells = 0;
  int right = 0;
};
Verdict verify(const TrackedPattern& pattern, const PlaneMap& map,
               std::span<const GrayImage> pyramid);

}  // namespace modar::tracker
