// What the current context offers, and the same lowered to a device profile.
#include <algorithm>
#include <string_view>

#include <GLES2/gl2.h>

#include "modar/device_profile.hpp"
#include "modar/gl_context.hpp"
#include "runtime/platform/extension_list.hpp"

namespace modar {
namespace {

std::string gl_string(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(text));
}

int gl_integer(GLenum name, int least) {
  GLint value = 0;
  glGetIntegerv(name, &value);
  return std::max(static_cast<int>(value), least);
}

/// "OpenGL ES 3.2 Mesa ..." to 3; 2 where the string is of another form.
int es_major(std::string_view version) {
  constexpr std::string_view kPrefix = "OpenGL ES ";
  if (version.substr(0, kPrefix.size()) != kPrefix) return 2;
  const std::string_view number = version.substr(kPrefix.size());
  return !number.empty() && number[0] >= '2' && number[0] <= '9' ? number[0] - '0' : 2;
}

}  // namespace

GlCaps probe_gl_caps() {
  GlCaps caps;
  caps.vendor = gl_string(GL_VENDOR);
  caps.renderer = gl_string(GL_RENDERER);
  caps.version = gl_string(GL_VERSION);
  const std::string extensions = gl_string(GL_EXTENSIONS);
  const auto has = [&](std::string_view name) { return lists_extension(extensions, name); };
  const bool es3 = es_major(caps.version) >= 3;
  caps.half_float_vertices = has("GL_OES_vertex_half_float");
  caps.etc1 = has("GL_OES_compressed_ETC1_RGB8_texture");
  caps.etc1_sub_texture = caps.etc1 && has("GL_EXT_compressed_ETC1_RGB8_sub_texture");
  caps.npot_mipmaps = es3 || has("GL_OES_texture_npot");
  caps.depth24 = es3 || has("GL_OES_depth24");
  caps.debug_groups = has("GL_KHR_debug") || has("GL_EXT_debug_marker");
  caps.instanced_arrays = es3 || has("GL_EXT_instanced_arrays") || has("GL_ANGLE_instanced_arrays");
  caps.max_texture_size = gl_integer(GL_MAX_TEXTURE_SIZE, 64);
  caps.max_vertex_uniform_vectors = gl_integer(GL_MAX_VERTEX_UNIFORM_VECTORS, 128);
  caps.max_vertex_attributes = gl_integer(GL_MAX_VERTEX_ATTRIBS, 8);
  return caps;
}

Result<GlCaps> mask_gl_caps(const GlCaps& caps, const std::string& device) {
  const DeviceProfile* profile = find_device_profile(device);
  if (profile == nullptr) {
    return fail(ExitCode::kUsage, "device.unknown", device, "there is no device of this name",
                "name one of " + device_profile_names());
  }
  GlCaps masked = caps;
  const auto mask = [&](bool& flag, std::string_view extension) {
    flag = flag && profile->has_extension(extension);
  };
  const bool es3 = profile->es_version >= 30;
  mask(masked.half_float_vertices, "GL_OES_vertex_half_float");
  mask(masked.etc1, "GL_OES_compressed_ETC1_RGB8_texture");
  mask(masked.etc1_sub_texture, "GL_EXT_compressed_ETC1_RGB8_sub_texture");
  masked.debug_groups = masked.debug_groups && (profile->has_extension("GL_KHR_debug") ||
                                                profile->has_extension("GL_EXT_debug_marker"));
  if (!es3) {
    mask(masked.npot_mipmaps, "GL_OES_texture_npot");
    mask(masked.depth24, "GL_OES_depth24");
    masked.instanced_arrays =
        masked.instanced_arrays && (profile->has_extension("GL_EXT_instanced_arrays") ||
                                    profile->has_extension("GL_ANGLE_instanced_arrays"));
  }
  masked.max_texture_size = std::min(caps.max_texture_size, profile->max_texture_size);
  masked.max_vertex_uniform_vectors =
      std::min(caps.max_vertex_uniform_vectors, profile->max_vertex_uniform_vectors);
  masked.max_vertex_attributes =
      std::min(caps.max_vertex_attributes, profile->max_vertex_attributes);
  masked.gpu_memory = std::uint64_t{profile->gpu_memory_mib} << 20;
  return masked;
}

}  // namespace modar
