// What the renderer asks of OpenGL ES 2.0: its constants, the entry points of extensions, and the
// context's state, remembered so that nothing is set twice. Internal to runtime/render.
#pragma once

#include <array>
#include <cstdint>

#include <GLES2/gl2.h>
#include <GLES2/gl2ext.h>

#include "modar/gl_context.hpp"

namespace modar {

/// Fixed attribute locations of every model program; a location per semantic, rows for instances.
enum AttributeSlot : GLuint {
  kAttributePosition = 0,
  kAttributeNormal = 1,
  kAttributeUv = 2,
  kAttributeColour = 3,
  kAttributeSlot = 4,    ///< the vertex's own choice of a slot
  kAttributeRows = 5,    ///< the first of three rows that step once an instance
  kAttributeJoints = 5,  ///< and weights behind it, of vertices that bones turn: no instances
  kAttributeMorphX = 7,
  kAttributeMorphY = 4,
  kAttributeMorphZ = 3,  ///< a layout has these or colours
  kAttributeCount = 8,
};

struct GlExtensions {
  PFNGLDRAWELEMENTSINSTANCEDEXTPROC draw_elements_instanced = nullptr;
  PFNGLVERTEXATTRIBDIVISOREXTPROC vertex_attrib_divisor = nullptr;
  PFNGLPUSHDEBUGGROUPKHRPROC push_debug_group = nullptr;
  PFNGLPOPDEBUGGROUPKHRPROC pop_debug_group = nullptr;
  PFNGLPUSHGROUPMARKEREXTPROC push_group_marker = nullptr;
  PFNGLPOPGROUPMARKEREXTPROC pop_group_marker = nullptr;
  PFNGLBINDVERTEXARRAYOESPROC bind_vertex_array = nullptr;  ///< of ES 3, or of the extension
  void(GL_APIENTRYP bind_sampler)(GLuint unit, GLuint sampler) = nullptr;  ///< of ES 3
  /// Of ES 3, or of GL_EXT_multisampled_render_to_texture.
  PFNGLRENDERBUFFERSTORAGEMULTISAMPLEEXTPROC renderbuffer_storage_multisample = nullptr;
  PFNGLFRAMEBUFFERTEXTURE2DMULTISAMPLEEXTPROC framebuffer_texture_multisample = nullptr;
  PFNGLBLITFRAMEBUFFERNVPROC blit_framebuffer = nullptr;  ///< of ES 3

  [[nodiscard]] bool instancing() const {
    return draw_elements_instanced != nullptr && vertex_attrib_divisor != nullptr;
  }
};

/// Of ES 3: glCopyBufferSubData(); null if none. Apart from GlExtensions, so that
/// programs of whole bundles do not link it.
using CopyBuffer = void(GL_APIENTRYP)(GLenum from, GLenum to, GLintptr from_offset,
                                      GLintptr to_offset, GLsizeiptr size);
CopyBuffer look_up_copy_buffer();

/// caps: masked ones; what they lack is not looked up.
GlExtensions load_gl_extensions(const GlCaps& caps);

/// Of ES 3, which gl2.h does not name: it has a framebuffer to read from besides.
constexpr GLenum kReadFramebuffer = 0x8CA8;
constexpr GLenum kDrawFramebuffer = 0x8CA9;

/// GL state that our calls change, restored to the app's when this ends: framebuffers,
/// viewport, vertex array object, program, buffers, the textures and samplers of units 0 to 2, the
/// active unit, blending, culling, depth, scissor, stencil test, polygon offset, masks, clear
/// colour and the pixel store. Of the default vertex array object, the attributes 0 to 7 end
/// disabled, with a divisor of 0, and their pointers are ours.
class SavedGlState {
 public:
  /// all: false saves and restores the framebuffer alone (RenderOptions::exclusive_context).
  SavedGlState(const GlExtensions& extensions, bool all);
  SavedGlState(const SavedGlState&) = delete;
  SavedGlState& operator=(const SavedGlState&) = delete;
  ~SavedGlState();

 private:
  static constexpr std::size_t kUnits = 3;
  static constexpr std::size_t kStored = 6;

  void save_objects();
  void restore_objects() const;

  const GlExtensions& extensions_;
  bool all_;
  GLint framebuffer_ = 0;
  GLint read_framebuffer_ = 0;  ///< of ES 3
  GLint renderbuffer_ = 0;
  GLint vertex_array_ = 0;
  std::array<GLint, 2> pixel_buffers_{};  ///< pack, unpack
  GLint program_ = 0;
  GLint array_buffer_ = 0;
  GLint index_buffer_ = 0;
  GLint active_unit_ = 0;
  std::array<GLint, kUnits> textures_{};
  std::array<GLint, kUnits> samplers_{};
  std::array<GLint, 4> viewport_{};
  std::array<GLint, 4> scissor_{};
  std::array<GLint, 6> blend_{};  ///< equations and factors: RGB, then alpha
  std::array<GLint, 3> modes_{};  ///< culled face, front face, depth function
  std::array<GLint, kStored> pixel_store_{};
  std::array<GLboolean, 6> switches_{};
  std::array<GLboolean, 4> colour_mask_{};
  GLboolean depth_mask_ = 0;
  std::array<GLfloat, 4> clear_colour_{};
  std::array<GLfloat, 2> depth_range_{};
  GLfloat clear_depth_ = 1;
};

/// Names the GL commands of its lifetime for profilers and traces, where the context can.
class DebugGroup {
 public:
  DebugGroup(const GlExtensions& extensions, const char* label);
  DebugGroup(const DebugGroup&) = delete;
  DebugGroup& operator=(const DebugGroup&) = delete;
  ~DebugGroup();

 private:
  const GlExtensions& extensions_;
};

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
  void set_depth_writes(bool enabled);
  void set_colour_writes(bool enabled);

  /// Call this after putting a program in use by other means.
  void forget_program() { program_ = kUnknown; }
  /// Call these before deleting a name, since GL may give it out again.
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
  bool depth_writes_ = true;
  bool colour_writes_ = true;
  GLenum front_face_ = GL_CCW;
};

}  // namespace modar
