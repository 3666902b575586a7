// An off-screen OpenGL ES 2.0 context by EGL (a pbuffer on the system's display, or on Mesa's
// surfaceless platform without one); what a context offers, and the same lowered to a
// device profile.
#include "modar/gl_context.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES2/gl2.h>

#include "formats/texture_format.hpp"
#include "modar/device_profile.hpp"
#include "runtime/platform/gl/extension_list.hpp"

namespace modar {
namespace {

EGLDisplay initialised(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY) return EGL_NO_DISPLAY;
  return eglInitialize(display, nullptr, nullptr) == EGL_TRUE ? display : EGL_NO_DISPLAY;
}

EGLDisplay surfaceless_display() {
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (extensions == nullptr || !lists_extension(extensions, "EGL_EXT_platform_base") ||
      !lists_extension(extensions, "EGL_MESA_platform_surfaceless")) {
    return EGL_NO_DISPLAY;
  }
  const auto get_platform_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_platform_display == nullptr) return EGL_NO_DISPLAY;
  return get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
}

bool choose_config(EGLDisplay display, EGLConfig& config) {
  const EGLint attributes[] = {EGL_SURFACE_TYPE,
                               EGL_PBUFFER_BIT,
                               EGL_RENDERABLE_TYPE,
                               EGL_OPENGL_ES2_BIT,
                               EGL_RED_SIZE,
                               8,
                               EGL_GREEN_SIZE,
                               8,
                               EGL_BLUE_SIZE,
                               8,
                               EGL_ALPHA_SIZE,
                               8,
                               EGL_NONE};
  EGLint count = 0;
  return eglChooseConfig(display, attributes, &config, 1, &count) == EGL_TRUE && count == 1;
}

tl::unexpected<Error> no_context(const char* cause) {
  return fail(ExitCode::kUnsupported, "gl.context", "EGL", cause,
              "install a driver (Debian: libegl1, libgles2, libgl1-mesa-dri)");
}

}  // namespace

struct GlContext::Handles {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLSurface surface = EGL_NO_SURFACE;
  EGLContext context = EGL_NO_CONTEXT;

  /// Creates context and pbuffer on `display` and makes them current; false leaves nothing behind.
  bool start() {
    EGLConfig config = nullptr;
    if (!choose_config(display, config) || eglBindAPI(EGL_OPENGL_ES_API) != EGL_TRUE) return false;
    const EGLint version[] = {EGL_CONTEXT_CLIENT_VERSION, 2, EGL_NONE};
    context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
    // We draw into framebuffers of our own: the pbuffer only makes the context current.
    const EGLint size[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
    surface = eglCreatePbufferSurface(display, config, size);
    if (context != EGL_NO_CONTEXT && surface != EGL_NO_SURFACE &&
        eglMakeCurrent(display, surface, surface, context) == EGL_TRUE) {
      return true;
    }
    stop();
    return false;
  }

  void stop() {
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (surface != EGL_NO_SURFACE) eglDestroySurface(display, surface);
    if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    surface = EGL_NO_SURFACE;
    context = EGL_NO_CONTEXT;
  }
};

Result<std::unique_ptr<GlContext>> GlContext::create_offscreen() {
  auto handles = std::make_unique<Handles>();
  bool found_display = false;
  for (const bool surfaceless : {false, true}) {
    handles->display =
        initialised(surfaceless ? surfaceless_display() : eglGetDisplay(EGL_DEFAULT_DISPLAY));
    if (handles->display == EGL_NO_DISPLAY) continue;
    found_display = true;
    if (handles->start()) return std::unique_ptr<GlContext>(new GlContext(std::move(handles)));
  }
  return no_context(found_display ? "no OpenGL ES 2.0 context with 8-bit colours could be made"
                                  : "neither a display nor an off-screen context could be opened");
}

GlContext::GlContext(std::unique_ptr<Handles> handles) : handles_(std::move(handles)) {}

// The display stays initialised: eglTerminate() would end other contexts on it.
GlContext::~GlContext() {
  handles_->stop();
}

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

/// Of GlCaps::texture_formats.
std::uint32_t bit_of(const TextureFormatInfo& format) {
  return std::uint32_t{1} << static_cast<std::uint32_t>(format.format);
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
  if (es3 && caps.version.find("WebGL") != std::string::npos) {
    caps.half_float_vertices = true;
    caps.half_float_type = 0x140B;
  }
  for (const TextureFormatInfo& format : kTextureFormats) {
    if (has(format.gl_extension)) caps.texture_formats |= bit_of(format);
  }
  if (has("GL_WEBGL_compressed_texture_etc1") || has("GL_WEBGL_compressed_texture_etc")) {
    caps.texture_formats |=
        bit_of(*find_texture_format(static_cast<std::uint32_t>(TextureFormat::kEtc1Rgb)));
    if (!has("GL_WEBGL_compressed_texture_etc1")) caps.etc1_format = 0x9274;
  }
  caps.etc1_sub_texture =
      caps.reads(TextureFormat::kEtc1Rgb) &&
      (has("GL_EXT_compressed_ETC1_RGB8_sub_texture") || caps.etc1_format == 0x9274);
  caps.npot_mipmaps = es3 || has("GL_OES_texture_npot");
  caps.depth24 = es3 || has("GL_OES_depth24");
  caps.debug_groups = has("GL_KHR_debug") || has("GL_EXT_debug_marker");
  caps.instanced_arrays = es3 || has("GL_EXT_instanced_arrays") || has("GL_ANGLE_instanced_arrays");
  caps.vertex_arrays = es3 || has("GL_OES_vertex_array_object");
  caps.es3 = es3;
  caps.multisampled_textures = has("GL_EXT_multisampled_render_to_texture");
  // Both have four at least; the question is no call of ES 2.0, which profiles are held to.
  if (es3 || caps.multisampled_textures) caps.max_samples = 4;
  caps.max_texture_size = gl_integer(GL_MAX_TEXTURE_SIZE, 64);
  caps.max_vertex_uniform_vectors = gl_integer(GL_MAX_VERTEX_UNIFORM_VECTORS, 128);
  caps.max_vertex_attributes = gl_integer(GL_MAX_VERTEX_ATTRIBS, 8);
  return caps;
}

Result<GlCaps> mask_gl_caps(const GlCaps& caps, const std::string& device) {
  const DeviceProfile* profile = find_device_profile(device);
  if (profile == nullptr) {
    return fail(ExitCode::kUsage, "device.unknown", device, "unknown device",
                "name one of " + device_profile_names());
  }
  GlCaps masked = caps;
  const auto mask = [&](bool& flag, std::string_view extension) {
    flag = flag && profile->has_extension(extension);
  };
  const bool es3 = profile->es_version >= 30;
  mask(masked.half_float_vertices, "GL_OES_vertex_half_float");
  for (const TextureFormatInfo& format : kTextureFormats) {
    if (!profile->has_extension(format.gl_extension)) masked.texture_formats &= ~bit_of(format);
  }
  mask(masked.multisampled_textures, "GL_EXT_multisampled_render_to_texture");
  mask(masked.etc1_sub_texture, "GL_EXT_compressed_ETC1_RGB8_sub_texture");
  masked.debug_groups = masked.debug_groups && (profile->has_extension("GL_KHR_debug") ||
                                                profile->has_extension("GL_EXT_debug_marker"));
  if (!es3) {
    mask(masked.npot_mipmaps, "GL_OES_texture_npot");
    mask(masked.depth24, "GL_OES_depth24");
    masked.instanced_arrays =
        masked.instanced_arrays && (profile->has_extension("GL_EXT_instanced_arrays") ||
                                    profile->has_extension("GL_ANGLE_instanced_arrays"));
    mask(masked.vertex_arrays, "GL_OES_vertex_array_object");
    masked.es3 = false;
    if (!masked.multisampled_textures) masked.max_samples = 1;
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
