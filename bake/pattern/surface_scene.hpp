// Camera frames that show a curved pattern: rays against cylinders, cones and planes, by formulas
// of their own, so that they judge the tracker's.
#pragma once

#include <array>

#include <glm/vec2.hpp>

#include "bake/pattern/picture.hpp"
#include "formats/pattern_shape.hpp"
#include "modar/camera.hpp"
#include "modar/pose.hpp"

namespace modar {

/// The pattern's corners in the frame, whether the object hides them or not, in the order of
/// Detection; of faces: of the first.
std::array<glm::dvec2, 4> surface_corners(const GrayImage& pattern, const PatternSurface& surface,
                                          const Camera& camera, const Pose& pose);

/// A pose that looks at the object's middle from `around` degrees about its axis and `above`
/// degrees above, with the picture's nearest pixels `scale` frame pixels wide, rolled, towards the
/// place `sight` of the frame (in multiples of its focal length from the middle).
Pose surface_pose(const GrayImage& pattern, const PatternSurface& surface, const Camera& camera,
                  double around, double above, double roll, double scale, glm::dvec2 sight);

/// Draws the object over the frame: the picture where it is printed, gray elsewhere, a little
/// darker where it turns away. covered: the share of the picture, from its left edge, that shows as
/// gray.
void draw_surface(const GrayImage& pattern, const PatternSurface& surface, const Camera& camera,
                  const Pose& pose, double covered, GrayPicture& frame);

}  // namespace modar
