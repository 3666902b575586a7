// What a bundle's models and scenes look like, for a page.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <glm/gtc/quaternion.hpp>

#include "bake/image/image.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"

namespace modar {

/// The finest gray image of a pattern that its tracker record holds; empty if none.
RgbaImage pattern_image(const BundleView& bundle, std::uint32_t pattern);

/// Draws with the device's renderer, off-screen.
class ModelCamera {
 public:
  /// Errors: kUnsupported "gl.*". The bundle's bytes outlive the camera.
  static Result<std::unique_ptr<ModelCamera>> create(const BundleView& bundle, int width,
                                                     int height);
  ~ModelCamera();

  /// A model alone, turned as in its first scene, or as the bundle states that it stands.
  RgbaImage model(std::uint32_t index);
  /// The same, turned further about the axis that points up.
  RgbaImage turned(std::uint32_t index, double degrees);
  /// A model alone, with its axes turned so.
  RgbaImage standing(std::uint32_t index, const glm::dquat& rotation);
  /// A model in a clip of its, at a share of the clip's time, from where all of them are in sight.
  RgbaImage moving(std::uint32_t clip, double share);
  /// A scene's model on its pattern, seen as somebody at a table sees it.
  RgbaImage scene(std::uint32_t index);

 private:
  struct State;
  explicit ModelCamera(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// The triangles of a model as ModelCamera::model() sees it, as SVG: chunks in colours of their
/// own, of the finest level of detail that has at most `most` of them (else the coarsest). Answers
/// the number of triangles drawn in `drawn`.
std::string wireframe_svg(const BundleView& bundle, std::uint32_t model, std::size_t most,
                          std::size_t& drawn);

}  // namespace modar
