// `modar-lab bench light`: models as the device shades them, compared with plain shading and a path
// tracer. Internal to bake/extensions/lab.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "bake/extensions/lab/bench.hpp"
#include "bake/image/image.hpp"
#include "formats/base/error.hpp"

namespace modar {

struct LightBenchOptions {
  /// Files, each with ",up=y" behind it where that axis points up (else z).
  std::vector<std::string> models;
  std::string pattern;  ///< the picture below all of them
  std::string folder;   ///< for the pictures; empty: none are written
  bool made = true;     ///< a cut-out plant, a glass, and black gloss, metal and clay besides
  std::string light;    ///< panorama of the room of the last three; empty: one that is made
  int width = 320;      ///< of a picture, pixels
  int height = 240;
  int samples = 64;  ///< paths a pixel of the reference
  unsigned jobs = 1;
  std::function<void(double done)> progress;  ///< may be empty
};

/// A row a model and region, in CIEDE2000, the mean over pixels. "NAME model": where the model is,
/// and "NAME ground": where its shadow and its light change the ground by 1 % and more. ours: the
/// renderer compared with the reference; reference: plain shading without a shadow in comparison.
/// "NAME evening": the model in darker, warmer light, of which the renderer knows the camera's
/// picture alone; the reference does not follow it. "NAME noise" (ours alone): two references of
/// half the paths, which differ by about twice the reference's own error. Then the means over all
/// models. Writes FOLDER/NAME.png (camera picture, plain, ours, reference; of the evening fixed,
/// following, reference) and FOLDER/light.png (all of them). Errors: those of baking and of GL; kIo
/// where a picture cannot be written.
Result<std::vector<BenchRow>> bench_light(const LightBenchOptions& options);

/// The first input is a bundle, the others are pictures of its patterns. A row a picture, in
/// CIEDE2000, the mean over the models' pixels: how far light that follows the picture (ours), and
/// plain shading (reference), are from the scenes' own light. Writes FOLDER/before_after.png:
/// plain, in the scenes' light, in the picture's; a row a picture. Errors: those of reading and of
/// GL; kIo.
Result<std::vector<BenchRow>> bench_before_after(const std::vector<std::string>& inputs,
                                                 const std::string& folder);

/// Writes room.hdr, a panorama, and gloss.obj, metal.obj and clay.obj, a vase each, into a folder
/// that exists, and answers their paths in this order. z is up. Errors: kIo "io.write".
Result<std::vector<std::string>> make_reflecting_subjects(const std::string& folder);

/// Pictures of one height, side by side, or of one width, one below the other.
RgbaImage joined(const std::vector<RgbaImage>& images, bool across);

/// Writes plant.obj (crossed cards with a picture of leaves, in a pot) and glass.obj (a bowl that
/// is half transparent, a ball in it) with their materials and pictures into a folder that exists,
/// and answers their paths. z is up. Errors: kIo "io.write".
Result<std::vector<std::string>> make_light_subjects(const std::string& folder);

}  // namespace modar
