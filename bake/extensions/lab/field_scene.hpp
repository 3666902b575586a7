// Frames as phones deliver them in the field: one disturbance each, of light, lens, sensor, codec
// or the print itself.
#pragma once

#include <array>
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
  double focal = 1;            ///< of the focal length of the camera below
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
/// degrees, through that condition. camera: the lens. other: picture whose
/// middle another edition shows.
FieldFrame render_field(const GrayImage& pattern, const GrayImage& other, const Camera& camera,
                        const GrayPicture& background, const FieldCondition& condition,
                        Random& random);

/// The pattern under a homography (row by row, from its pixels to the frame's) over the background,
/// without blur, light or noise.
FieldFrame render_homography(const GrayImage& pattern, const std::array<double, 9>& homography,
                             const GrayPicture& background);

/// Another edition of a print: its border and layout around another photo in the middle 70 % of
/// both sides.
GrayPicture edition_of(const GrayImage& pattern, const GrayImage& other);
/// The same print in another language: 2/5 of it are other words of the same look, which here are
/// small blocks each turned by half a turn.
GrayPicture language_of(const GrayImage& pattern);

/// A hand-held camera's path: slow sines of all six parameters about a pose, of such amplitudes
/// that the pattern stays in the frame and moves by up to 15 pixels a frame at speed 1.
class HandPath {
 public:
  HandPath(const Pose& middle, Random& random);
  /// tremor: 1 adds one of 6 to 13 Hz, of 23 pixels at most in a frame 1280 wide.
  [[nodiscard]] Pose at(double time_s, double speed, double tremor = 0) const;

 private:
  Pose middle_;
  std::array<double, 12> phase_{};
};

}  // namespace modar
