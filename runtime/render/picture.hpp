// Whole pictures: the off-screen framebuffer that is drawn into, and the camera's picture behind
// the models. Internal to runtime/render.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "formats/base/error.hpp"
#include "modar/gl_context.hpp"
#include "modar/renderer.hpp"
#include "runtime/render/gl.hpp"

namespace modar {

class Target {
 public:
  /// Makes the framebuffer anew at that size, with this many samples per pixel at most. Errors:
  /// kUnsupported "gl.framebuffer".
  Result<void> resize(int width, int height, int samples, const GlCaps& caps,
                      const GlExtensions& extensions, GlState& gl);
  void release(GlState& gl);

  /// Draw calls go here from now on.
  void begin() const { glBindFramebuffer(GL_FRAMEBUFFER, drawn_ != 0 ? drawn_ : framebuffer_); }
  /// The drawing is in the texture from now on.
  void finish(const GlExtensions& extensions) const;
  /// The finished drawing is read from here.
  void bind() const { glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_); }
  [[nodiscard]] GLuint texture() const { return texture_; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

 private:
  bool attach(int width, int height, int samples, GLenum depth_format,
              const GlExtensions& extensions);

  GLuint framebuffer_ = 0;  ///< with the texture
  GLuint drawn_ = 0;        ///< with renderbuffers of several samples; 0: the other is drawn into
  GLuint texture_ = 0;
  GLuint colour_ = 0;  ///< of drawn_
  GLuint depth_ = 0;
  int width_ = 0;
  int height_ = 0;
  int asked_ = 1;  ///< samples
};

/// Corners of a viewport (0 or 1, y up) to texture coordinates: start + x * across + y * up.
struct TextureMap {
  std::array<float, 4> turn{1.0f, 0.0f, 0.0f, -1.0f};  ///< across, then up
  std::array<float, 2> start{0.0f, 1.0f};              ///< as it stands: row 0 is the picture's top
};

class Background {
 public:
  /// Makes the rectangle and the RGB program in the current context. Errors: kUnsupported "gl.*".
  Result<void> create();
  void release(GlState& gl);

  /// Sends the picture's changed rows to its textures, and counts. Textures are made anew where
  /// size or format change.
  void upload(const CameraPicture& picture, GlState& gl, RenderStats& stats);
  /// Fills the viewport with the picture sent last; exact: a texel is a pixel there. Answers the
  /// draw calls: none where the driver cannot link the format's shader.
  int draw(bool exact, const TextureMap& map, GlState& gl);
  /// Fills the viewport with any texture whose first row is the bottom one.
  int draw_texture(GLuint texture, GlState& gl);

 private:
  /// RGB, luma with pairs of chroma, or luma with two planes of chroma.
  enum Kind : std::size_t { kRgb, kPair, kPlanes, kKinds };
  struct Program {
    GLuint id = 0;
    GLint turn = -1;
    GLint start = -1;
    GLint range = -1;
    GLint swap = -1;
    bool failed = false;
  };
  struct Plane {
    GLuint texture = 0;
    GLint filter = 0;
  };

  static Kind kind_of(PictureFormat format);
  Result<void> link(Kind kind);
  void allocate(const CameraPicture& picture, GlState& gl);
  void set_filters(bool exact, GlState& gl);
  int draw_rectangle(const Program& program, const TextureMap& map, GlState& gl);

  std::array<Program, kKinds> programs_;
  std::array<Plane, 3> planes_;
  GLuint rectangle_ = 0;
  PictureFormat format_ = PictureFormat::kRgb;
  bool full_range_ = true;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace modar
