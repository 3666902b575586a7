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
  double tilt_low = 0;  ///< degrees between the line of sight and the pattern's normal
  double tilt_high = 45;
  double covered_low = 0;  ///< share of the pattern behind something else
  double covered_high = 0;
  bool pattern = true;  ///< false: the photo alone
};

/// The bands of the article's experiments and beyond, as bench tables print them.
std::vector<SceneBand> pose_bands();

struct SceneFrame {
  GrayPicture picture;
  Pose pose;
  std::array<glm::dvec2, 4> corners{};  ///< of the truth, as in Sighting
};

/// Draws a pose of the band: any roll, the pattern's centre in the frame.
Pose draw_pose(const SceneBand& band, const GrayImage& pattern, const Camera& camera,
               Random& random);

/// Renders the pattern at the pose over the background, with other light, mild blur and noise of
/// standard deviation 3. blur: additional motion blur in pixels, along `blur_angle` (radians).
SceneFrame render_scene(const GrayImage& pattern, const Camera& camera, const Pose& pose,
                        const GrayPicture& background, const SceneBand& band, Random& random,
                        double blur = 0, double blur_angle = 0);

/// A photo as a background of that size. Errors: those of read_image().
Result<GrayPicture> load_background(const std::string& path, int width, int height);

}  // namespace modar
