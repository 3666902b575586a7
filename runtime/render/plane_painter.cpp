#include "runtime/render/plane_painter.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "runtime/render/program.hpp"

namespace modar {

Result<void> PlanePainter::create(const BundleView& bundle) {
  std::size_t pictures = 0;
  for (std::uint32_t i = 0; i < bundle.nodes().size(); ++i) pictures += is_picture(bundle, i);
  if (pictures == 0) return {};
  planes_.reserve(pictures);
  glGenBuffers(1, &buffer_);
  for (std::size_t twin = 0; twin < programs_.size(); ++twin) {
    MODAR_ASSIGN(programs_[twin], link_program(twin == 0 ? "" : "#define ALPHA_TWIN\n",
                                               shadow_vertex_source(), plane_fragment_source()));
    glUseProgram(programs_[twin]);
    glUniform1i(glGetUniformLocation(programs_[twin], "u_texture"), 0);
    glUniform1i(glGetUniformLocation(programs_[twin], "u_alpha"), 1);
    glUniform1f(glGetUniformLocation(programs_[twin], "u_depth"), 1.0f);
  }
  return {};
}

void PlanePainter::release(GlState& gl) {
  gl.forget_buffer(buffer_);
  glDeleteBuffers(1, &buffer_);
  for (const GLuint program : programs_) glDeleteProgram(program);
  *this = PlanePainter();
}

void PlanePainter::draw(const BundleView& bundle, const glm::mat4& projection,
                        std::span<const DrawItem> items, const TextureStore& textures,
                        bool see_through, GlState& gl, RenderStats& stats) {
  if (buffer_ == 0) return;
  planes_.clear();
  for (std::uint32_t i = 0; i < items.size() && planes_.size() < planes_.capacity(); ++i) {
    if (!is_picture(bundle, items[i].node)) continue;
    const std::uint32_t texture = bundle.nodes()[items[i].node].subject;
    if ((textures.alpha(texture) != 0) != see_through) continue;
    planes_.push_back({-items[i].to_eye[3].z, i, texture});
  }
  // From far to near; those of one depth, as on one pattern, in the order of the items.
  std::sort(planes_.begin(), planes_.end(), [](const Plane& a, const Plane& b) {
    return a.depth != b.depth ? a.depth > b.depth : a.item < b.item;
  });
  for (const Plane& plane : planes_) {
    gl.use_program(programs_[see_through ? 1 : 0]);
    gl.set_culling(false);
    gl.set_depth_test(true);
    gl.set_depth_writes(!see_through);
    gl.set_colour_writes(true);
    gl.set_blending(see_through);
    gl.bind_texture(0, textures.colour(plane.texture));
    if (see_through) gl.bind_texture(1, textures.alpha(plane.texture));
    draw_plane(projection * items[plane.item].to_eye, gl, stats);
  }
  gl.set_depth_writes(true);
}

void PlanePainter::draw_plane(const glm::mat4& to_clip, GlState& gl, RenderStats& stats) {
  std::array<Vertex, 4> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const glm::vec2 uv(i % 2, i / 2);
    // The first row of a texture is the top one.
    corners[i] = {to_clip * glm::vec4(2.0f * uv.x - 1.0f, 1.0f - 2.0f * uv.y, 0.0f, 1.0f), uv};
  }
  gl.bind_array_buffer(buffer_);
  glBufferData(GL_ARRAY_BUFFER, sizeof corners, corners.data(), GL_STREAM_DRAW);
  constexpr GLsizei kStride = sizeof(Vertex);
  gl.set_attribute(kAttributePosition, {buffer_, 4, GL_FLOAT, GL_FALSE, kStride, 0});
  gl.set_attribute(kAttributeUv, {buffer_, 2, GL_FLOAT, GL_FALSE, kStride, offsetof(Vertex, uv)});
  gl.enable_attributes(1u << kAttributePosition | 1u << kAttributeUv);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, static_cast<GLsizei>(corners.size()));
  ++stats.draw_calls;
  stats.triangles += 2;
  stats.bytes_uploaded += sizeof corners;
}

}  // namespace modar
