// The camera's picture as textures, drawn as one rectangle; also the copy of a texture to a window.
#pragma once

#include <array>
#include <cstdint>

#include "formats/error.hpp"
#include "modar/image.hpp"
#include "runtime/render/gl_state.hpp"

namespace modar {

class Background {
 public:
  /// Makes the rectangle and the RGB program in the current context. Errors: kUnsupported "gl.*".
  Result<void> create();
  void release(GlState& gl);
  void forget();

  /// Sends the picture to its texture: bytes sent. The texture is made anew where the size changes.
  std::uint64_t upload(const RgbImage& picture, GlState& gl);
  /// Fills the viewport with the picture sent last; exact: a texel is a pixel there.
  int draw(bool exact, GlState& gl);
  /// Fills the viewport with any texture whose first row is the bottom one.
  int draw_texture(GLuint texture, GlState& gl);

 private:
  int draw_rectangle(GLuint texture, const std::array<float, 4>& uv, GlState& gl);

  GLuint rectangle_ = 0;
  GLuint program_ = 0;
  GLint uv_ = -1;
  GLuint texture_ = 0;
  GLint filter_ = 0;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace modar
