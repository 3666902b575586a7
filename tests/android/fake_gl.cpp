// EGL for the fake android.opengl of the tests: a pbuffer stands for the phone's window.
#include <array>
#include <cstdlib>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES2/gl2.h>
#include <jni.h>

namespace {

struct Surface {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  EGLSurface surface = EGL_NO_SURFACE;
  int width = 0;
  int height = 0;
};
thread_local Surface current;

}  // namespace

#define FAKE_GL(type, name) extern "C" JNIEXPORT type JNICALL Java_fake_GlContext_##name

FAKE_GL(void, create)(JNIEnv*, jclass, jint width, jint height) {
  Surface made;
  made.width = width;
  made.height = height;
  made.display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
  eglInitialize(made.display, nullptr, nullptr);
  eglBindAPI(EGL_OPENGL_ES_API);
  const std::array<EGLint, 13> wanted = {EGL_SURFACE_TYPE,
                                         EGL_PBUFFER_BIT,
                                         EGL_RENDERABLE_TYPE,
                                         EGL_OPENGL_ES2_BIT,
                                         EGL_RED_SIZE,
                                         8,
                                         EGL_GREEN_SIZE,
                                         8,
                                         EGL_BLUE_SIZE,
                                         8,
                                         EGL_DEPTH_SIZE,
                                         16,
                                         EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  eglChooseConfig(made.display, wanted.data(), &config, 1, &count);
  const std::array<EGLint, 5> size = {EGL_WIDTH, width, EGL_HEIGHT, height, EGL_NONE};
  const std::array<EGLint, 3> version = {EGL_CONTEXT_CLIENT_VERSION, 2, EGL_NONE};
  made.surface = eglCreatePbufferSurface(made.display, config, size.data());
  made.context = eglCreateContext(made.display, config, EGL_NO_CONTEXT, version.data());
  if (!eglMakeCurrent(made.display, made.surface, made.surface, made.context)) std::abort();
  current = made;
}

FAKE_GL(void, destroy)(JNIEnv*, jclass) {
  eglMakeCurrent(current.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(current.display, current.context);
  eglDestroySurface(current.display, current.surface);
  eglReleaseThread();
  current = {};
}

FAKE_GL(void, read)(JNIEnv* env, jclass, jobject rgba) {
  glReadPixels(0, 0, current.width, current.height, GL_RGBA, GL_UNSIGNED_BYTE,
               env->GetDirectBufferAddress(rgba));
}

FAKE_GL(void, clear)(JNIEnv*, jclass) {
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

FAKE_GL(jstring, string)(JNIEnv* env, jclass, jint name) {
  return env->NewStringUTF(reinterpret_cast<const char*>(glGetString(static_cast<GLenum>(name))));
}
