// The camera's picture as textures, drawn as one rectangle.
#include "runtime/render/background.hpp"

#include "runtime/render/program.hpp"

namespace modar {
namespace {

void set_filter(GLint filter) {
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
}

}  // namespace

Result<void> Background::create() {
  const Result<GLuint> program =
      link_program("", background_vertex_source(), background_fragment_source());
  if (!program) return tl::unexpected<Error>(program.error());
  program_ = *program;
  glUseProgram(program_);
  glUniform1i(glGetUniformLocation(program_, "u_texture"), 0);
  uv_ = glGetUniformLocation(program_, "u_uv");
  const float corners[] = {0, 0, 1, 0, 0, 1, 1, 1};
  glGenBuffers(1, &rectangle_);
  glBindBuffer(GL_ARRAY_BUFFER, rectangle_);
  glBufferData(GL_ARRAY_BUFFER, sizeof corners, corners, GL_STATIC_DRAW);
  return {};
}

void Background::release(GlState& gl) {
  gl.forget_texture(texture_);
  gl.forget_buffer(rectangle_);
  glDeleteTextures(1, &texture_);
  glDeleteBuffers(1, &rectangle_);
  glDeleteProgram(program_);
  forget();
}

void Background::forget() {
  *this = Background();
}

std::uint64_t Background::upload(const RgbImage& picture, GlState& gl) {
  if (texture_ == 0) glGenTextures(1, &texture_);
  gl.bind_texture(0, texture_);
  if (picture.width != width_ || picture.height != height_) {
    width_ = picture.width;
    height_ = picture.height;
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB, width_, height_, 0, GL_RGB, GL_UNSIGNED_BYTE, nullptr);
    // ES 2.0 takes pictures that are no power of two only without mipmaps and clamped.
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    filter_ = 0;
  }
  if (picture.stride == std::ptrdiff_t{3} * width_) {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, GL_RGB, GL_UNSIGNED_BYTE,
                    picture.pixels);
  } else {
    // ES 2.0 cannot step over padding: row by row, without a copy of ours.
    for (int y = 0; y < height_; ++y) {
      glTexSubImage2D(GL_TEXTURE_2D, 0, 0, y, width_, 1, GL_RGB, GL_UNSIGNED_BYTE,
                      picture.pixels + y * picture.stride);
    }
  }
  return std::uint64_t{3} * static_cast<std::uint64_t>(width_) *
         static_cast<std::uint64_t>(height_);
}

int Background::draw(bool exact, GlState& gl) {
  gl.bind_texture(0, texture_);
  const GLint filter = exact ? GL_NEAREST : GL_LINEAR;
  if (filter != filter_) {
    filter_ = filter;
    set_filter(filter);
  }
  // Row 0 of the texture is the top of the picture.
  return draw_rectangle(texture_, {1.0f, -1.0f, 0.0f, 1.0f}, gl);
}

int Background::draw_texture(GLuint texture, GlState& gl) {
  return draw_rectangle(texture, {1.0f, 1.0f, 0.0f, 0.0f}, gl);
}

int Background::draw_rectangle(GLuint texture, const std::array<float, 4>& uv, GlState& gl) {
  gl.use_program(program_);
  gl.bind_texture(0, texture);
  gl.set_depth_test(false);
  gl.set_blending(false);
  gl.set_culling(false);
  gl.set_attribute(kAttributePosition, {rectangle_, 2, GL_FLOAT, GL_FALSE, 8, 0});
  gl.enable_attributes(1u << kAttributePosition);
  glUniform4fv(uv_, 1, uv.data());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  return 1;
}

}  // namespace modar
