// Remembers what is set in the context, so that nothing is set twice, and counts what is.
#pragma once

#include <array>
#include <cstdint>

#include "runtime/render/gl_api.hpp"

namespace modar {

/// A vertex attribute as glVertexAttribPointer takes it, with the buffer that it reads.
struct AttributePointer {
  GLuint buffer = 0;
  GLint components = 0;
  GLenum type = 0;
  GLboolean normalised = 0;
  GLsizei stride = 0;
  std::uintptr_t offset = 0;
  bool operator==(const AttributePointer&) const = default;
};

class GlState {
 public:
  /// Forgets everything: somebody else may have drawn since. Sets what all our draws share.
  void reset();

  void use_program(GLuint program);
  void bind_array_buffer(GLuint buffer);
  void bind_index_buffer(GLuint buffer);
  /// unit: 0, 1 or 2.
  void bind_texture(GLuint unit, GLuint texture);
  /// The same, and glTexImage2D and its kin act on that texture.
  void edit_texture(GLuint unit, GLuint texture);
  void set_attribute(GLuint location, const AttributePointer& pointer);
  /// Enables exactly the locations of the mask.
  void enable_attributes(std::uint32_t mask);
  void set_culling(bool enabled);
  void set_front_face(GLenum winding);
  void set_blending(bool enabled);
  void set_depth_test(bool enabled);

  /// To be told when another program was put in use behind our back.
  void forget_program() { program_ = kUnknown; }
  /// To be told when names are deleted, since GL may give them out again.
  void forget_buffer(GLuint buffer);
  void forget_texture(GLuint texture);

  int changes = 0;  ///< GL calls made here since the caller set it to 0

 private:
  void activate(GLuint unit);

  static constexpr GLuint kUnknown = 0xFFFFFFFFu;
  GLuint program_ = kUnknown;
  GLuint array_buffer_ = kUnknown;
  GLuint index_buffer_ = kUnknown;
  GLuint active_unit_ = kUnknown;
  std::array<GLuint, 3> textures_{kUnknown, kUnknown, kUnknown};
  std::array<AttributePointer, kAttributeCount> attributes_{};
  std::uint32_t enabled_ = 0;
  bool culling_ = false;
  bool blending_ = false;
  bool depth_test_ = false;
  GLenum front_face_ = GL_CCW;
};

}  // namespace modar
