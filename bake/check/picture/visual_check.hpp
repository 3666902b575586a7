// Models of a bundle as the device shows them, compared with their sources.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/bundle/bundle_builder.hpp"
#include "bake/check/picture/level_look.hpp"
#include "bake/image/image.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "formats/check.hpp"

namespace modar {

struct VisualOptions {
  std::vector<ModelRequest> models;  ///< with their names
  std::string picture_folder;        ///< the worst view of each model goes there; empty: nowhere
  int side = 512;                    ///< of a view, pixels
  double least_ssim = 0.9;           ///< gates, over what shows the model
  double greatest_delta_e = 4.0;
  unsigned jobs = 1;
  double crease = 40;   ///< of generated normals, see WeldOptions
  bool repair = false;  ///< compare with the repaired source, see repair_model()
  bool repair_support = false;
  std::function<void(double done)> progress;  ///< may be empty
};

/// Views from corners of an icosahedron, 12 in all.
struct ViewsLook {
  double ssim_mean = 1;
  double ssim_worst = 1;
  double delta_e_mean = 0;   ///< see mean_delta_e(); mean over the views
  double delta_e_worst = 0;  ///< of the worst view
  int worst_view = 0;
};

/// A clip at three times, with a third of the views each.
struct ClipLook : ViewsLook {
  std::string name;
  double worst_s = 0;  ///< time of the worst view
};

/// The views of one model at rest, and of its clips.
struct ModelLook : ViewsLook {
  std::string name;
  bool judged = false;            ///< false: it is translucent, which the reference does not draw
  std::vector<ClipLook> clips;    ///< that the source has by that name
  std::string picture;            ///< source and bundle side by side; empty: not written
  std::vector<LevelLook> levels;  ///< each where it is first drawn, the finest left out
};

/// An sRGB pixel in CIELAB (D65).
glm::dvec3 lab_of(const std::uint8_t* pixel);

/// CIEDE2000 of two colours in CIELAB. Sharma, Wu, Dalal, "The CIEDE2000 Color-Difference Formula",
/// 2005.
double ciede2000(const glm::dvec3& a, const glm::dvec3& b);

/// Mean CIEDE2000 over the pixels where both images differ from `clear`; 0 if none: outlines are
/// for SSIM to judge. Each pixel is the mean of 3 x 3: nobody sees where within two pixels an edge
/// is. Images of one size, sRGB.
double mean_delta_e(const RgbaImage& a, const RgbaImage& b,
                    const std::array<std::uint8_t, 3>& clear);

/// Renders sources in double precision from uncompressed pictures and the bundle by the real
/// renderer, off-screen, without its occlusion. Models whose source is not there are left out.
/// Reports VISUAL_DIFFERS. Errors: those of reading sources; kUnsupported "gl.*"; kIo where a
/// picture cannot be written.
Result<std::vector<ModelLook>> check_looks(const BundleView& bundle, const VisualOptions& options,
                                           const IssueSink& sink);

}  // namespace modar
