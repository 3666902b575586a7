// Frames as phones deliver them in the field: one disturbance each, of light, lens, sensor, codec
// or the print itself.
#pragma once

#include <string>
#include <vector>

#include "bake/pattern/pattern.hpp"

namespace modar {

/// One condition; every member but the name leaves the frame alone at its default.
struct FieldCondition {
  std::string name;
  double motion_px = 0;        ///< length of the motion blur
  double defocus_px = 0;       ///< standard deviation of the lens blur beyond the focused one
  double gain = 1;             ///< exposure
  double noise = 3;            ///< standard deviation, gray values
  bool denoised = false;       ///< a phone's bilateral filter after the noise
  double contrast = 1;         ///< about mid-gray, before the noise
  double gamma = 1;            ///< exponent of the tone curve
  int jpeg_quality = 0;        ///< 1 to 100 of the standard luminance table; 0: not compressed
  bool glare = false;          ///< half of the pattern saturated, with a soft edge
  bool shadow = false;         ///< a shadow's edge across the pattern, 45 % of the light behind it
  double shutter_px = 0;       ///< rolling shutter: shift of the last row against the first
  bool distorting = false;     ///< the lens distorts and the tracker is not told
  double focal = 1;            ///< true focal length over the one that the tracker assumes
  double bend_radius = 0;      ///< of the paper about its vertical axis, pattern widths; 0: flat
  bool mirrored = false;       ///< the print is the mirror image: any recognition is false
  bool other_edition = false;  ///< the same layout around another photo: any recognition is false
};
std::vector<FieldCondition> field_conditions();

struct FieldFrame {
  GrayPicture picture;
  FrameTruth truth;
};

/// The pattern (or what the condition makes of it) at a random pose, area 0.5 to 2 and up to 45
/// degrees, through that condition. camera: the one the tracker assumes. other: picture whose
/// middle another edition shows.
FieldFrame render_field(const GrayImage& pattern, const GrayImage& other, const Camera& camera,
                        const GrayPicture& background, const FieldCondition& condition,
                        Random& random);

/// The pattern under a homography (row by row, from its pixels to the frame's) over the background,
/// without blur, light or noise.
FieldFrame render_homography(const GrayImage& pattern, const std::array<double, 9>& homography,
                             const GrayPicture& background);

}  // namespace modar
