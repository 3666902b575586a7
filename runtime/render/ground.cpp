// Rectangles of the patterns' planes.
#include "runtime/render/ground.hpp"

#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include "runtime/render/program.hpp"

namespace modar {
namespace {

GLuint shadow_texture(std::span<const std::byte> section) {
  const auto& header = *reinterpret_cast<const ShadowHeader*>(section.data());
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_LUMINANCE, static_cast<GLsizei>(header.width),
               static_cast<GLsizei>(header.height), 0, GL_LUMINANCE, GL_UNSIGNED_BYTE,
               section.data() + sizeof header);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

/// The shadow goes with the model where a visitor has turned, moved or enlarged that, and stays in
/// the plane.
glm::mat4 shadow_to_eye(const DrawItem& item, const SceneRecord& scene) {
  glm::mat4 moved =
      glm::inverse(item.world_to_eye) * item.to_eye * glm::inverse(scene_matrix(scene));
  for (int column = 0; column < 4; ++column) moved[column][2] = 0.0f;
  return item.world_to_eye * moved;
}

}  // namespace

Result<void> Ground::create(const BundleView& bundle) {
  if (bundle.scenes().empty()) return {};
  const float corners[] = {0, 0, 1, 0, 0, 1, 1, 1};
  glGenBuffers(1, &rectangle_);
  glBindBuffer(GL_ARRAY_BUFFER, rectangle_);
  glBufferData(GL_ARRAY_BUFFER, sizeof corners, corners, GL_STATIC_DRAW);
  MODAR_ASSIGN(program_, link_program("", shadow_vertex_source(), shadow_fragment_source()));
  matrix_ = glGetUniformLocation(program_, "u_matrix");
  place_ = glGetUniformLocation(program_, "u_rectangle");
  depth_ = glGetUniformLocation(program_, "u_depth");
  glUseProgram(program_);
  glUniform1i(glGetUniformLocation(program_, "u_texture"), 0);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (std::uint32_t scene = 0; scene < bundle.scenes().size(); ++scene) {
    const auto section = bundle.section(SectionType::kShadow, scene);
    textures_.push_back(section.empty() ? 0 : shadow_texture(section));
  }
  return {};
}

void Ground::release(GlState& gl) {
  for (const GLuint texture : textures_) {
    gl.forget_texture(texture);
    glDeleteTextures(1, &texture);
  }
  gl.forget_buffer(rectangle_);
  glDeleteBuffers(1, &rectangle_);
  glDeleteProgram(program_);
  *this = Ground();
}

void Ground::draw_rectangle(const glm::mat4& matrix, const std::array<float, 4>& rectangle,
                            float depth, GlState& gl, RenderStats& stats) const {
  gl.use_program(program_);
  gl.set_culling(false);
  gl.set_attribute(kAttributePosition, {rectangle_, 2, GL_FLOAT, GL_FALSE, 8, 0});
  gl.enable_attributes(1u << kAttributePosition);
  glUniformMatrix4fv(matrix_, 1, GL_FALSE, glm::value_ptr(matrix));
  glUniform4fv(place_, 1, rectangle.data());
  glUniform1f(depth_, depth);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  ++stats.draw_calls;
  stats.bytes_uploaded += sizeof matrix + sizeof rectangle;
}

void Ground::draw_shadows(const BundleView& bundle, const glm::mat4& projection,
                          std::span<const DrawItem> items, GlState& gl, RenderStats& stats) {
  for (const DrawItem& item : items) {
    if (item.scene >= textures_.size() || textures_[item.scene] == 0) continue;
    const auto& header = *reinterpret_cast<const ShadowHeader*>(
        bundle.section(SectionType::kShadow, item.scene).data());
    gl.bind_texture(0, textures_[item.scene]);
    gl.set_depth_test(false);
    gl.set_blending(true);
    draw_rectangle(projection * shadow_to_eye(item, bundle.scenes()[item.scene]),
                   {header.low[0], header.low[1], header.high[0] - header.low[0],
                    header.high[1] - header.low[1]},
                   0.0f, gl, stats);
  }
}

void Ground::hide_below(const BundleView& bundle, const glm::mat4& projection,
                        std::span<const DrawItem> items, GlState& gl, RenderStats& stats) {
  gl.set_colour_writes(false);
  for (const DrawItem& item : items) {
    if (item.scene >= bundle.scenes().size()) continue;
    const PatternRecord& pattern = bundle.patterns()[bundle.scenes()[item.scene].pattern];
    gl.bind_texture(0, textures_[item.scene]);
    gl.set_depth_test(true);
    gl.set_blending(false);
    draw_rectangle(projection * item.world_to_eye,
                   {-pattern.half_width, -pattern.half_height, 2 * pattern.half_width,
                    2 * pattern.half_height},
                   1.0f, gl, stats);
  }
  gl.set_colour_writes(true);
}

}  // namespace modar
