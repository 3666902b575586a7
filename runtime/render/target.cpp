// The off-screen framebuffer.
#include "runtime/render/target.hpp"

namespace modar {

Result<void> Target::resize(int width, int height, const GlCaps& caps, GlState& gl) {
  if (width == width_ && height == height_ && framebuffer_ != 0) return {};
  gl.reset();
  release(gl);
  if (width < 1 || height < 1 || width > caps.max_texture_size || height > caps.max_texture_size) {
    return fail(ExitCode::kUnsupported, "gl.framebuffer", "renderer",
                "this size of picture is not possible on this device",
                "ask for a smaller picture, of at least 1x1");
  }
  glGenTextures(1, &texture_);
  gl.edit_texture(0, texture_);
  // A texture, not a renderbuffer: those have at best 5-6-5 bits in ES 2.0 without extensions.
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glGenRenderbuffers(1, &depth_);
  glBindRenderbuffer(GL_RENDERBUFFER, depth_);
  const GLenum depth_format =
      caps.depth24 ? GLenum{GL_DEPTH_COMPONENT24_OES} : GLenum{GL_DEPTH_COMPONENT16};
  glRenderbufferStorage(GL_RENDERBUFFER, depth_format, width, height);
  glGenFramebuffers(1, &framebuffer_);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_);
  // The texture must not be read while it is drawn to.
  gl.bind_texture(0, 0);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    release(gl);
    return fail(ExitCode::kUnsupported, "gl.framebuffer", "renderer",
                "the driver refuses a framebuffer of this size", "ask for a smaller picture");
  }
  width_ = width;
  height_ = height;
  return {};
}

void Target::release(GlState& gl) {
  gl.forget_texture(texture_);
  glDeleteFramebuffers(1, &framebuffer_);
  glDeleteRenderbuffers(1, &depth_);
  glDeleteTextures(1, &texture_);
  *this = Target();
}

}  // namespace modar
