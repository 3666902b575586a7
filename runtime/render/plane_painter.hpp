// Pictures that stand on patterns: rectangles that show a texture, unlit. Internal to
// runtime/render.
#pragma once

#include <array>
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
#include "runtime/render/texture_store.hpp"

namespace modar {

class PlanePainter {
 public:
  /// Nothing where the bundle has no picture. Errors: kUnsupported "gl.shader", "gl.program".
  Result<void> create(const BundleView& bundle);
  void release(GlState& gl);

  /// Draws the pictures among the items that hide all that is behind them, which comes before the
  /// models, or the others, which come after them, from far to near.
  void draw(const BundleView& bundle, const glm::mat4& projection, std::span<const DrawItem> items,
            const TextureStore& textures, bool see_through, GlState& gl, RenderStats& stats);

 private:
  /// A corner in clip space, and where its texel lies.
  struct Vertex {
    glm::vec4 place;
    glm::vec2 uv;
  };
  struct Plane {
    float depth = 0.0f;  ///< of the middle, before the eye
    std::uint32_t item = 0;
    std::uint32_t texture = 0;
  };

  void draw_plane(const glm::mat4& to_clip, GlState& gl, RenderStats& stats);

  std::vector<Plane> planes_;
  std::array<GLuint, 2> programs_{};  ///< without an alpha twin, with one
  GLuint buffer_ = 0;
};

}  // namespace modar
