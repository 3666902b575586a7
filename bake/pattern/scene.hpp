// Rendered camera frames that show a pattern at a known pose over photos: what trials, checks and
// benches judge the tracker on.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "formats/base/error.hpp"
#include "formats/pattern_shape.hpp"
#include "modar/camera.hpp"
#include "modar/pattern_views.hpp"
#include "modar/pose.hpp"

namespace modar {

/// Ranges from which a frame's pose and coverage are drawn.
struct SceneBand {
  std::string name;
  double area_low = 0.4;  ///< pixels in the frame for each pixel of the pattern's picture
  double area_high = 4.0;
  double tilt_low = 0;  ///< degrees from the pattern's normal to the line of sight to its centre
  double tilt_high = 45;
  double covered_low = 0;  ///< share of the pattern that something else covers
  double covered_high = 0;
  bool pattern = true;  ///< false: the photo alone
  double roll_low = 0;  ///< degrees about the line of sight
  double roll_high = 360;
  const PatternSurface* surface = nullptr;  ///< null: flat; else tilts are above or below, and
  double around_low = 0;                    ///< degrees about its axis, to either side
  double around_high = 0;
};

struct SceneFrame {
  GrayPicture picture;
  Pose pose;
  std::array<glm::dvec2, 4> corners{};  ///< of the truth, as in Detection
};

/// Draws a pose of the band with the pattern's centre in the frame. Tilts are measured from the
/// line of sight: a pattern at the frame's side that is parallel to the sensor is tilted.
Pose draw_pose(const SceneBand& band, const GrayImage& pattern, const Camera& camera,
               Random& random);

/// Exposure of a frame: gray * gain + bias, where the gain changes linearly across the frame.
struct SceneLight {
  double gain = 1;
  double bias = 0;
  double slope_x = 0;  ///< of the gain, over the frame's width
  double slope_y = 0;
  double focus = 0.65;  ///< standard deviation of the lens blur, pixels
  double noise = 3;     ///< standard deviation, gray values
};
SceneLight draw_light(Random& random);

struct MotionBlur {
  double length = 0;  ///< pixels
  double angle = 0;   ///< radians
};

/// Blurs along a line.
void blur_motion(MotionBlur blur, GrayPicture& picture);

/// Renders the pattern at the pose through the camera's lens over the background, then applies
/// blur, exposure and noise. light: null draws one.
SceneFrame render_scene(const GrayImage& pattern, const Camera& camera, const Pose& pose,
                        const GrayPicture& background, const SceneBand& band, Random& random,
                        const SceneLight* light = nullptr, MotionBlur blur = {});

/// The same without exposure and noise, which expose() adds: for several exposures of one view.
SceneFrame render_still(const GrayImage& pattern, const Camera& camera, const Pose& pose,
                        const GrayPicture& background, const SceneBand& band, Random& random,
                        double focus, MotionBlur blur);
void expose(const GrayPicture& still, const SceneLight& light, Random& random,
            GrayPicture& picture);

/// A background without a photo: noise of every scale, with features to be mistaken for a
/// pattern's.
GrayPicture made_background(int width, int height, Random& random);

/// The photo rotated, scaled and moved at random, mirrored beyond its borders.
GrayPicture another_view(const GrayPicture& photo, Random& random);

/// A photo as a background of that size, cropped in the middle. Errors: those of read_image().
Result<GrayPicture> load_background(const std::string& path, int width, int height);
/// The same of several.
Result<std::vector<GrayPicture>> load_backgrounds(const std::vector<std::string>& paths, int width,
                                                  int height);

}  // namespace modar
