// An off-screen OpenGL ES 2.0 context by EGL: a pbuffer on the system's display, or on Mesa's
// surfaceless platform where there is none.
#include "modar/gl_context.hpp"

#include <utility>

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include "runtime/platform/extension_list.hpp"

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
                                  : "no display could be opened, and none that needs no screen");
}

GlContext::GlContext(std::unique_ptr<Handles> handles) : handles_(std::move(handles)) {}

// The display stays initialised: eglTerminate() would end other contexts on it.
GlContext::~GlContext() {
  handles_->stop();
}

}  // namespace modar
