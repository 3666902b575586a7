// Camera frames with a pattern in them at a known pose, over photos: the input of the pose bench.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "bake/pattern/view_render.hpp"
#include "formats/error.hpp"
#include "modar/camera.hpp"
#include "modar/pose.hpp"

namespace modar {

/// Ranges from which a frame's pose and disturbance are drawn.
struct SceneBand {
  std::string name;
  double area_low = 0.4;  ///< of the pattern in the frame to the pattern's image
  double area_high = 4.0;
  double tilt_low = 0;  ///< degrees from the pattern's normal to the line of sight to its centre
  double tilt_high = 45;
  double covered_low = 0;  ///< share of the pattern behind something else
  double covered_high = 0;
  bool pattern = true;  ///< false: the photo alone
  double roll_low = 0;  ///< degrees about the line of sight
  double roll_high = 360;
};

/// The bands of the article's experiments and beyond, as bench tables print them.
std::vector<SceneBand> pose_bands();

struct SceneFrame {
  GrayPicture picture;
  Pose pose;
  std::array<glm::dvec2, 4> corners{};  ///< of the truth, as in Detection
};

/// Draws a pose of the band, the pattern's centre in the frame. Tilts are what the eye sees: a
/// pattern at the frame's side that lies parallel to the sensor is tilted.
Pose draw_pose(const SceneBand& band, const GrayImage& pattern, const Camera& camera,
               Random& random);

/// Light on the pattern and its surroundings: gray * gain + bias, the gain with a slope over the
/// frame's sides.
struct SceneLight {
  double gain = 1;
  double bias = 0;
  double slope_x = 0;
  double slope_y = 0;
  double focus = 0.65;  ///< standard deviation of the lens blur, pixels
  double noise = 3;     ///< standard deviation, gray values
};
SceneLight draw_light(Random& random);

struct MotionBlur {
  double length = 0;  ///< pixels
  double angle = 0;   ///< radians
};

/// Renders the pattern at the pose through the camera's lens over the background, then blurs,
/// lights and adds noise. light: null draws one.
SceneFrame render_scene(const GrayImage& pattern, const Camera& camera, const Pose& pose,
                        const GrayPicture& background, const SceneBand& band, Random& random,
                        const SceneLight* light = nullptr, MotionBlur blur = {});

/// The same frame before light and noise, which expose() adds: several exposures of one view.
SceneFrame render_still(const GrayImage& pattern, const Camera& camera, const Pose& pose,
                        const GrayPicture& background, const SceneBand& band, Random& random,
                        double focus, MotionBlur blur);
void expose(const GrayPicture& still, const SceneLight& light, Random& random,
            GrayPicture& picture);

/// A background where no photo is at hand: smooth blotches with texture of every size, so that
/// there is something to be mistaken for.
GrayPicture made_background(int width, int height, Random& random);

/// The photo turned, scaled and moved at random, mirrored beyond its borders.
GrayPicture another_view(const GrayPicture& photo, Random& random);

/// A photo as a background of that size. Errors: those of read_image().
Result<GrayPicture> load_background(const std::string& path, int width, int height);

}  // namespace modar
