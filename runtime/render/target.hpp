// The off-screen framebuffer: a colour texture and a depth buffer.
#pragma once

#include "formats/error.hpp"
#include "modar/gl_context.hpp"
#include "runtime/render/gl_state.hpp"

namespace modar {

class Target {
 public:
  /// Makes the framebuffer anew at that size. Errors: kUnsupported "gl.framebuffer".
  Result<void> resize(int width, int height, const GlCaps& caps, GlState& gl);
  void release(GlState& gl);

  /// Draw calls go here from now on.
  void bind() const { glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_); }
  [[nodiscard]] GLuint texture() const { return texture_; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  GLuint framebuffer_ = 0;
  GLuint texture_ = 0;
  GLuint depth_ = 0;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace modar
