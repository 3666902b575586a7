// EGL for the fake android.opengl of the tests: a texture stands for the phone's window. It is what
// the player draws into, too: Mesa rounds otherwise in a pbuffer, whose rows go the other way.
#include <array>
#include <cstdlib>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES2/gl2.h>
#include <GLES2/gl2ext.h>
#include <jni.h>

namespace {

struct Surface {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
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
  const std::array<EGLint, 5> wanted = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                        EGL_OPENGL_ES2_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  eglChooseConfig(made.display, wanted.data(), &config, 1, &count);
  const std::array<EGLint, 3> version = {EGL_CONTEXT_CLIENT_VERSION, 2, EGL_NONE};
  made.context = eglCreateContext(made.display, config, EGL_NO_CONTEXT, version.data());
  if (!eglMakeCurrent(made.display, EGL_NO_SURFACE, EGL_NO_SURFACE, made.context)) std::abort();
  GLuint colour = 0;
  GLuint depth = 0;
  GLuint window = 0;
  glGenTextures(1, &colour);
  glBindTexture(GL_TEXTURE_2D, colour);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glBindTexture(GL_TEXTURE_2D, 0);
  glGenRenderbuffers(1, &depth);
  glBindRenderbuffer(GL_RENDERBUFFER, depth);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24_OES, width, height);
  glGenFramebuffers(1, &window);
  glBindFramebuffer(GL_FRAMEBUFFER, window);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) std::abort();
  current = made;
}

FAKE_GL(void, destroy)(JNIEnv*, jclass) {
  eglMakeCurrent(current.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(current.display, current.context);
  eglReleaseThread();
  current = {};
}

FAKE_GL(void, read)(JNIEnv* env, jclass, jobject rgba) {
  glReadPixels(0, 0, current.width, current.height, GL_RGBA, GL_UNSIGNED_BYTE,
               env->GetDirectBufferAddress(rgba));
}

FAKE_GL(void, clear)(JNIEnv*, jclass, jfloat gray) {
  glClearColor(gray, gray, gray, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

FAKE_GL(jstring, string)(JNIEnv* env, jclass, jint name) {
  return env->NewStringUTF(reinterpret_cast<const char*>(glGetString(static_cast<GLenum>(name))));
}
