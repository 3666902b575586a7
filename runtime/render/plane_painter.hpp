// Pictures on patterns: rectangles that show a texture, unlit. Internal to
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
#include "runtime/render/texture_store.hpp"

namespace modar {

/// The texture of a picture, or of a video's poster. node: is_picture().
inline std::uint32_t picture_texture(const BundleView& bundle, std::uint32_t node) {
  const NodeRecord& record = bundle.nodes()[node];
  const bool video = record.kind == static_cast<std::uint32_t>(NodeKind::kVideo);
  return video ? bundle.media()[record.subject].poster : record.subject;
}

class PlanePainter {
 public:
  /// Nothing where the bundle has no picture. Errors: kUnsupported "gl.shader", "gl.program".
  Result<void> create(const BundleView& bundle);
  void release(GlState& gl);
  /// See Renderer::set_video().
  void set_video(std::uint32_t node, GLuint texture) {
    if (node < videos_.size()) videos_[node] = texture;
  }

  /// What drawing needs of a frame.
  struct Job {
    const BundleView& bundle;
    const glm::mat4& projection;
    std::span<const DrawItem> items;
    const TextureStore& textures;
    GlState& gl;
    RenderStats& stats;
  };
  /// Chooses the pictures among the items that hide all that is behind them, which are drawn before
  /// the models, or the others, which are drawn among what else is seen through.
  void choose(const Job& job, bool see_through);
  /// Draws those that were chosen and not drawn yet, from far to near: up to the last one that has
  /// a point between itself and the eye. point: in eye space; null: all.
  void draw(const Job& job, const glm::vec3* point);

 private:
  struct Plane {
    float depth = 0.0f;  ///< of the middle, before the eye
    std::uint32_t item = 0;
    std::size_t program = 0;
  };

  enum Program : std::size_t { kOpaque, kTwin, kBeside, kKey, kPrograms };

  [[nodiscard]] static Program program_of(const BundleView& bundle, std::uint32_t node);
  void draw_plane(const Job& job, const Plane& plane);

  std::vector<Plane> planes_;
  std::size_t drawn_ = 0;
  std::size_t chosen_ = 0;
  std::vector<GLuint> videos_;  ///< one a node: what it shows; 0: its poster, or no video
  std::array<GLuint, kPrograms> programs_{};
  GLint key_ = -1;
  GLuint buffer_ = 0;
};

}  // namespace modar
