// The pattern's plane under the models: their baked shadows on it, and what it hides. Internal to
// runtime/render.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "modar/renderer.hpp"
#include "runtime/render/gl.hpp"

namespace modar {

/// A corner in clip space, and the place of its texel.
struct ClipVertex {
  glm::vec4 place;
  glm::vec2 uv;
};

/// Draws vertices by the program in use, through a buffer of their own.
void draw_clip_vertices(std::span<const ClipVertex> vertices, GLenum mode, GLuint buffer,
                        GlState& gl, RenderStats& stats);

class Ground {
 public:
  /// Shadows are side by side in few textures, so that one call draws those of many models. Errors:
  /// kUnsupported "gl.shader", "gl.program".
  Result<void> create(const BundleView& bundle);
  void release(GlState& gl);

  /// Darkens the framebuffer, for each item of a scene with a shadow.
  void draw_shadows(const BundleView& bundle, const glm::mat4& projection,
                    std::span<const DrawItem> items, GlState& gl, RenderStats& stats);
  /// Fills the depth buffer over the patterns of the items' scenes.
  void hide_below(const BundleView& bundle, const glm::mat4& projection,
                  std::span<const DrawItem> items, GlState& gl, RenderStats& stats);

 private:
  struct Rectangle {
    glm::vec2 low{0.0f};
    glm::vec2 high{0.0f};
  };
  struct Shadow {
    std::uint32_t page = 0;  ///< 1: the first; 0: none
    std::uint32_t left = 0;  ///< texels of the page
    std::uint32_t first_row = 0;
  };
  struct ShadowPage {
    GLuint texture = 0;
    float width = 0;  ///< texels
    float height = 0;
  };

  void lay_out(const BundleView& bundle);
  void add_rectangle(const glm::mat4& matrix, const Rectangle& plane, const Rectangle& texels);
  /// All that were added, in one call.
  void draw_rectangles(float depth, GlState& gl, RenderStats& stats);

  std::vector<Shadow> shadows_;  ///< one a scene
  std::vector<ShadowPage> pages_;
  std::vector<ClipVertex> vertices_;
  GLuint buffer_ = 0;
  GLuint program_ = 0;
  GLint depth_ = -1;
};

}  // namespace modar
