// Entry points of extensions, debug groups and remembered state.
#include "runtime/render/gl.hpp"

#include <string_view>

#include <EGL/egl.h>

#include "runtime/platform/gl/extension_list.hpp"

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
  glDepthRangef(0.0f, 1.0f);
  glClearDepthf(1.0f);
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

void GlState::set_depth_writes(bool enabled) {
  if (differs(depth_writes_, enabled, changes)) glDepthMask(enabled ? GL_TRUE : GL_FALSE);
}

void GlState::set_colour_writes(bool enabled) {
  if (!differs(colour_writes_, enabled, changes)) return;
  const GLboolean on = enabled ? GL_TRUE : GL_FALSE;
  glColorMask(on, on, on, on);
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

CopyBuffer look_up_copy_buffer() {
  return reinterpret_cast<CopyBuffer>(eglGetProcAddress("glCopyBufferSubData"));
}

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
  if (caps.es3) {
    look_up(found.bind_vertex_array, "glBindVertexArray");
    look_up(found.bind_sampler, "glBindSampler");
    look_up(found.renderbuffer_storage_multisample, "glRenderbufferStorageMultisample");
    look_up(found.blit_framebuffer, "glBlitFramebuffer");
  } else if (caps.vertex_arrays && lists_extension(list, "GL_OES_vertex_array_object")) {
    look_up(found.bind_vertex_array, "glBindVertexArrayOES");
  }
  if (caps.multisampled_textures) {
    look_up(found.renderbuffer_storage_multisample, "glRenderbufferStorageMultisampleEXT");
    look_up(found.framebuffer_texture_multisample, "glFramebufferTexture2DMultisampleEXT");
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

namespace {

// Of ES 3, which gl2.h does not name.
constexpr std::array<GLenum, 2> kPixelBuffers = {0x88EB, 0x88EC};  // pack, unpack
constexpr std::array<GLenum, 2> kPixelBufferBindings = {0x88ED, 0x88EF};
constexpr GLenum kReadFramebufferBinding = 0x8CAA;
constexpr GLenum kVertexArrayBinding = 0x85B5;
constexpr GLenum kSamplerBinding = 0x8919;

constexpr std::array<GLenum, 6> kSwitches = {GL_BLEND,        GL_CULL_FACE,
                                             GL_DEPTH_TEST,   GL_SCISSOR_TEST,
                                             GL_STENCIL_TEST, GL_POLYGON_OFFSET_FILL};
constexpr std::array<GLenum, 6> kBlend = {GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA,
                                          GL_BLEND_SRC_RGB,      GL_BLEND_DST_RGB,
                                          GL_BLEND_SRC_ALPHA,    GL_BLEND_DST_ALPHA};
constexpr std::array<GLenum, 3> kModes = {GL_CULL_FACE_MODE, GL_FRONT_FACE, GL_DEPTH_FUNC};
/// The last four are of ES 3: length of rows and images, and skipped parts must be 0 for us.
constexpr std::array<GLenum, 6> kPixelStore = {
    GL_UNPACK_ALIGNMENT, GL_PACK_ALIGNMENT, 0x0CF2, 0x0CF3, 0x0CF4, 0x0D02};

GLint integer(GLenum name) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return value;
}

GLuint name_of(GLint value) {
  return static_cast<GLuint>(value);
}

}  // namespace

SavedGlState::SavedGlState(const GlExtensions& extensions, bool all)
    : extensions_(extensions), all_(all), framebuffer_(integer(GL_FRAMEBUFFER_BINDING)) {
  // ES 2 has one framebuffer for both; that of ES 3 is the one that is drawn into.
  if (extensions_.bind_sampler != nullptr) read_framebuffer_ = integer(kReadFramebufferBinding);
  if (!all_) return;
  save_objects();
  glGetIntegerv(GL_VIEWPORT, viewport_.data());
  glGetIntegerv(GL_SCISSOR_BOX, scissor_.data());
  for (std::size_t i = 0; i < kBlend.size(); ++i) blend_[i] = integer(kBlend[i]);
  for (std::size_t i = 0; i < kModes.size(); ++i) modes_[i] = integer(kModes[i]);
  for (std::size_t i = 0; i < kSwitches.size(); ++i) switches_[i] = glIsEnabled(kSwitches[i]);
  glGetBooleanv(GL_COLOR_WRITEMASK, colour_mask_.data());
  glGetBooleanv(GL_DEPTH_WRITEMASK, &depth_mask_);
  glGetFloatv(GL_COLOR_CLEAR_VALUE, clear_colour_.data());
  glGetFloatv(GL_DEPTH_CLEAR_VALUE, &clear_depth_);
  glGetFloatv(GL_DEPTH_RANGE, depth_range_.data());
}

void SavedGlState::save_objects() {
  renderbuffer_ = integer(GL_RENDERBUFFER_BINDING);
  program_ = integer(GL_CURRENT_PROGRAM);
  // The index buffer belongs to the vertex array object that is bound: it is saved after that is
  // left.
  if (extensions_.bind_vertex_array != nullptr) {
    vertex_array_ = integer(kVertexArrayBinding);
    if (vertex_array_ != 0) extensions_.bind_vertex_array(0);
  }
  array_buffer_ = integer(GL_ARRAY_BUFFER_BINDING);
  index_buffer_ = integer(GL_ELEMENT_ARRAY_BUFFER_BINDING);
  active_unit_ = integer(GL_ACTIVE_TEXTURE);
  const bool es3 = extensions_.bind_sampler != nullptr;
  for (std::size_t i = 0; i < kUnits; ++i) {
    const GLuint unit = static_cast<GLuint>(i);
    glActiveTexture(GL_TEXTURE0 + unit);
    textures_[i] = integer(GL_TEXTURE_BINDING_2D);
    if (!es3) continue;
    samplers_[i] = integer(kSamplerBinding);
    if (samplers_[i] != 0) extensions_.bind_sampler(unit, 0);
  }
  for (std::size_t i = 0; i < (es3 ? kStored : 2); ++i) {
    pixel_store_[i] = integer(kPixelStore[i]);
    if (i >= 2) glPixelStorei(kPixelStore[i], 0);
  }
  if (!es3) return;
  for (std::size_t i = 0; i < kPixelBuffers.size(); ++i) {
    pixel_buffers_[i] = integer(kPixelBufferBindings[i]);
    if (pixel_buffers_[i] != 0) glBindBuffer(kPixelBuffers[i], 0);
  }
}

SavedGlState::~SavedGlState() {
  if (extensions_.bind_sampler != nullptr) {
    glBindFramebuffer(kDrawFramebuffer, name_of(framebuffer_));
    glBindFramebuffer(kReadFramebuffer, name_of(read_framebuffer_));
  } else {
    glBindFramebuffer(GL_FRAMEBUFFER, name_of(framebuffer_));
  }
  if (!all_) return;
  restore_objects();
  glViewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
  glScissor(scissor_[0], scissor_[1], scissor_[2], scissor_[3]);
  for (std::size_t i = 0; i < kSwitches.size(); ++i) {
    (switches_[i] != GL_FALSE ? glEnable : glDisable)(kSwitches[i]);
  }
  const auto blend = [this](std::size_t i) { return static_cast<GLenum>(blend_[i]); };
  glBlendEquationSeparate(blend(0), blend(1));
  glBlendFuncSeparate(blend(2), blend(3), blend(4), blend(5));
  glCullFace(static_cast<GLenum>(modes_[0]));
  glFrontFace(static_cast<GLenum>(modes_[1]));
  glDepthFunc(static_cast<GLenum>(modes_[2]));
  glColorMask(colour_mask_[0], colour_mask_[1], colour_mask_[2], colour_mask_[3]);
  glDepthMask(depth_mask_);
  glClearColor(clear_colour_[0], clear_colour_[1], clear_colour_[2], clear_colour_[3]);
  glClearDepthf(clear_depth_);
  glDepthRangef(depth_range_[0], depth_range_[1]);
}

void SavedGlState::restore_objects() const {
  glBindRenderbuffer(GL_RENDERBUFFER, name_of(renderbuffer_));
  glUseProgram(name_of(program_));
  for (GLuint i = 0; i < kAttributeCount; ++i) {
    glDisableVertexAttribArray(i);
    if (extensions_.vertex_attrib_divisor != nullptr) extensions_.vertex_attrib_divisor(i, 0);
  }
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, name_of(index_buffer_));
  glBindBuffer(GL_ARRAY_BUFFER, name_of(array_buffer_));
  if (vertex_array_ != 0) extensions_.bind_vertex_array(name_of(vertex_array_));
  const bool es3 = extensions_.bind_sampler != nullptr;
  for (std::size_t i = 0; i < kUnits; ++i) {
    const GLuint unit = static_cast<GLuint>(i);
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, name_of(textures_[i]));
    if (es3 && samplers_[i] != 0) extensions_.bind_sampler(unit, name_of(samplers_[i]));
  }
  glActiveTexture(static_cast<GLenum>(active_unit_));
  for (std::size_t i = 0; i < (es3 ? kStored : 2); ++i)
    glPixelStorei(kPixelStore[i], pixel_store_[i]);
  for (std::size_t i = 0; i < kPixelBuffers.size(); ++i) {
    if (pixel_buffers_[i] != 0) glBindBuffer(kPixelBuffers[i], name_of(pixel_buffers_[i]));
  }
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
