// Entry points of extensions, debug groups and remembered state.
#include "runtime/render/gl.hpp"

#include <string_view>

#include <EGL/egl.h>

#include "runtime/platform/extension_list.hpp"

namespace modar {
namespace {

/// Stores `value` in `known`; true if they differed and GL has to be called.
template <class T>
bool differs(T& known, const T& value, int& changes) {
  if (known == value) return false;
  known = value;
  ++changes;
  return true;
}

void toggle(GLenum capability, bool enabled) {
  if (enabled) {
    glEnable(capability);
  } else {
    glDisable(capability);
  }
}

}  // namespace

void GlState::reset() {
  const int counted = changes;
  *this = GlState();
  changes = counted;
  for (GLuint i = 0; i < kAttributeCount; ++i) glDisableVertexAttribArray(i);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glCullFace(GL_BACK);
  glFrontFace(GL_CCW);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  // The picture's alpha stays what coverage makes it, for a caller that lays it over something.
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glBlendEquation(GL_FUNC_ADD);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
}

void GlState::use_program(GLuint program) {
  if (differs(program_, program, changes)) glUseProgram(program);
}

void GlState::bind_array_buffer(GLuint buffer) {
  if (differs(array_buffer_, buffer, changes)) glBindBuffer(GL_ARRAY_BUFFER, buffer);
}

void GlState::bind_index_buffer(GLuint buffer) {
  if (differs(index_buffer_, buffer, changes)) glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffer);
}

void GlState::bind_texture(GLuint unit, GLuint texture) {
  if (textures_[unit] == texture) return;
  activate(unit);
  textures_[unit] = texture;
  ++changes;
  glBindTexture(GL_TEXTURE_2D, texture);
}

void GlState::edit_texture(GLuint unit, GLuint texture) {
  activate(unit);
  bind_texture(unit, texture);
}

void GlState::activate(GLuint unit) {
  if (differs(active_unit_, unit, changes)) glActiveTexture(GL_TEXTURE0 + unit);
}

void GlState::set_attribute(GLuint location, const AttributePointer& pointer) {
  if (!differs(attributes_[location], pointer, changes)) return;
  bind_array_buffer(pointer.buffer);
  glVertexAttribPointer(location, pointer.components, pointer.type, pointer.normalised,
                        pointer.stride, reinterpret_cast<const void*>(pointer.offset));
}

void GlState::enable_attributes(std::uint32_t mask) {
  for (GLuint i = 0; i < kAttributeCount; ++i) {
    const std::uint32_t bit = 1u << i;
    if ((mask & bit) == (enabled_ & bit)) continue;
    ++changes;
    if ((mask & bit) != 0) {
      glEnableVertexAttribArray(i);
    } else {
      glDisableVertexAttribArray(i);
    }
  }
  enabled_ = mask;
}

void GlState::set_culling(bool enabled) {
  if (differs(culling_, enabled, changes)) toggle(GL_CULL_FACE, enabled);
}

void GlState::set_front_face(GLenum winding) {
  if (differs(front_face_, winding, changes)) glFrontFace(winding);
}

void GlState::set_blending(bool enabled) {
  if (differs(blending_, enabled, changes)) toggle(GL_BLEND, enabled);
}

void GlState::set_depth_test(bool enabled) {
  if (differs(depth_test_, enabled, changes)) toggle(GL_DEPTH_TEST, enabled);
}

void GlState::forget_buffer(GLuint buffer) {
  if (array_buffer_ == buffer) array_buffer_ = kUnknown;
  if (index_buffer_ == buffer) index_buffer_ = kUnknown;
  for (AttributePointer& attribute : attributes_) {
    if (attribute.buffer == buffer) attribute = AttributePointer();
  }
}

void GlState::forget_texture(GLuint texture) {
  for (GLuint& bound : textures_) {
    if (bound == texture) bound = kUnknown;
  }
}

namespace {

template <class Function>
void look_up(Function& function, const char* name) {
  function = reinterpret_cast<Function>(eglGetProcAddress(name));
}

std::string_view text_of(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text == nullptr ? std::string_view() : reinterpret_cast<const char*>(text);
}

}  // namespace

GlExtensions load_gl_extensions(const GlCaps& caps) {
  GlExtensions found;
  const std::string_view list = text_of(GL_EXTENSIONS);
  if (caps.instanced_arrays) {
    // The extensions first: core names may answer in a context of ES 2.0 that cannot use them.
    if (lists_extension(list, "GL_EXT_instanced_arrays")) {
      look_up(found.draw_elements_instanced, "glDrawElementsInstancedEXT");
      look_up(found.vertex_attrib_divisor, "glVertexAttribDivisorEXT");
    } else if (lists_extension(list, "GL_ANGLE_instanced_arrays")) {
      look_up(found.draw_elements_instanced, "glDrawElementsInstancedANGLE");
      look_up(found.vertex_attrib_divisor, "glVertexAttribDivisorANGLE");
    } else {
      look_up(found.draw_elements_instanced, "glDrawElementsInstanced");
      look_up(found.vertex_attrib_divisor, "glVertexAttribDivisor");
    }
  }
  if (caps.debug_groups && lists_extension(list, "GL_KHR_debug")) {
    look_up(found.push_debug_group, "glPushDebugGroupKHR");
    look_up(found.pop_debug_group, "glPopDebugGroupKHR");
  } else if (caps.debug_groups && lists_extension(list, "GL_EXT_debug_marker")) {
    look_up(found.push_group_marker, "glPushGroupMarkerEXT");
    look_up(found.pop_group_marker, "glPopGroupMarkerEXT");
  }
  return found;
}

DebugGroup::DebugGroup(const GlExtensions& extensions, const char* label)
    : extensions_(extensions) {
  if (extensions_.push_debug_group != nullptr) {
    extensions_.push_debug_group(GL_DEBUG_SOURCE_APPLICATION_KHR, 0, -1, label);
  } else if (extensions_.push_group_marker != nullptr) {
    extensions_.push_group_marker(0, label);
  }
}

DebugGroup::~DebugGroup() {
  if (extensions_.pop_debug_group != nullptr) {
    extensions_.pop_debug_group();
  } else if (extensions_.pop_group_marker != nullptr) {
    extensions_.pop_group_marker();
  }
}

}  // namespace modar
