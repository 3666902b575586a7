// Entry points of extensions, looked up only where the context lists the extension.
#pragma once

#include "modar/gl_context.hpp"
#include "runtime/render/gl_api.hpp"

namespace modar {

struct GlExtensions {
  PFNGLDRAWELEMENTSINSTANCEDEXTPROC draw_elements_instanced = nullptr;
  PFNGLVERTEXATTRIBDIVISOREXTPROC vertex_attrib_divisor = nullptr;
  PFNGLPUSHDEBUGGROUPKHRPROC push_debug_group = nullptr;
  PFNGLPOPDEBUGGROUPKHRPROC pop_debug_group = nullptr;
  PFNGLPUSHGROUPMARKEREXTPROC push_group_marker = nullptr;
  PFNGLPOPGROUPMARKEREXTPROC pop_group_marker = nullptr;

  [[nodiscard]] bool instancing() const {
    return draw_elements_instanced != nullptr && vertex_attrib_divisor != nullptr;
  }
};

/// caps: masked ones; what they lack is not looked up.
GlExtensions load_gl_extensions(const GlCaps& caps);

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

}  // namespace modar
