// Entry points of extensions, looked up only where the context lists the extension.
#include "runtime/render/gl_extensions.hpp"

#include <string_view>

#include <EGL/egl.h>

#include "runtime/platform/extension_list.hpp"

namespace modar {
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
