// The pattern's plane under the models: their baked shadows on it, and what it hides. Internal to
// runtime/render.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat4x4.hpp>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/renderer.hpp"
#include "runtime/render/gl.hpp"

namespace modar {

class Ground {
 public:
  /// One texture a scene that has a shadow. Errors: kUnsupported "gl.shader", "gl.program".
  Result<void> create(const BundleView& bundle);
  void release(GlState& gl);

  /// Darkens what is in the framebuffer, for each item of a scene with a shadow.
  void draw_shadows(const BundleView& bundle, const glm::mat4& projection,
                    std::span<const DrawItem> items, GlState& gl, RenderStats& stats);
  /// Fills the depth buffer where the patterns of the items' scenes lie.
  void hide_below(const BundleView& bundle, const glm::mat4& projection,
                  std::span<const DrawItem> items, GlState& gl, RenderStats& stats);

 private:
  void draw_rectangle(const glm::mat4& matrix, const std::array<float, 4>& rectangle, float depth,
                      GlState& gl, RenderStats& stats) const;

  std::vector<GLuint> textures_;  ///< one a scene; 0: no shadow
  GLuint rectangle_ = 0;
  GLuint program_ = 0;
  GLint matrix_ = -1;
  GLint place_ = -1;
  GLint depth_ = -1;
};

}  // namespace modar
