// EGL for the fake android.opengl of the tests: a texture replaces the phone's window. It is what
// the player draws into, too: Mesa rounds otherwise in a pbuffer, whose rows go the other way.
#include <array>
#include <cstdlib>
#include <string>

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
  GLuint window = 0;
};
thread_local Surface current;

/// A framebuffer with colour alone, which is bound then.
GLuint make_window(int width, int height) {
  GLuint colour = 0;
  GLuint window = 0;
  glGenTextures(1, &colour);
  glBindTexture(GL_TEXTURE_2D, colour);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glBindTexture(GL_TEXTURE_2D, 0);
  glGenFramebuffers(1, &window);
  glBindFramebuffer(GL_FRAMEBUFFER, window);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
  return window;
}

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
  GLuint depth = 0;
  made.window = make_window(width, height);
  glGenRenderbuffers(1, &depth);
  glBindRenderbuffer(GL_RENDERBUFFER, depth);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24_OES, width, height);
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

// The input of an encoder is a window as well.
FAKE_GL(jint, window)(JNIEnv*, jclass, jint width, jint height) {
  const GLuint window = make_window(width, height);
  glBindFramebuffer(GL_FRAMEBUFFER, current.window);
  return static_cast<jint>(window);
}

FAKE_GL(void, use)(JNIEnv*, jclass, jint window) {
  glBindFramebuffer(GL_FRAMEBUFFER, window == 0 ? current.window : static_cast<GLuint>(window));
}

FAKE_GL(void, pixels)(JNIEnv* env, jclass, jint width, jint height, jobject rgba) {
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, env->GetDirectBufferAddress(rgba));
}

FAKE_GL(void, clear)(JNIEnv*, jclass, jfloat gray) {
  glClearColor(gray, gray, gray, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

FAKE_GL(jstring, string)(JNIEnv* env, jclass, jint name) {
  return env->NewStringUTF(reinterpret_cast<const char*>(glGetString(static_cast<GLenum>(name))));
}

// --- android.opengl.GLES20: what the copy of a video's pictures needs ---

#define GLES20(type, name) extern "C" JNIEXPORT type JNICALL Java_android_opengl_GLES20_##name

namespace {

std::string text_of(JNIEnv* env, jstring text) {
  const char* letters = env->GetStringUTFChars(text, nullptr);
  std::string copy(letters);
  env->ReleaseStringUTFChars(text, letters);
  return copy;
}

GLenum word(jint value) {
  return static_cast<GLenum>(value);
}

/// Decoders' textures are plain ones here.
GLenum target_of(jint value) {
  return value == GL_TEXTURE_EXTERNAL_OES ? GL_TEXTURE_2D : word(value);
}

void give(JNIEnv* env, jintArray names, jint offset, GLuint name) {
  const auto value = static_cast<jint>(name);
  env->SetIntArrayRegion(names, offset, 1, &value);
}

}  // namespace

GLES20(jint, glCreateProgram)(JNIEnv*, jclass) {
  return static_cast<jint>(glCreateProgram());
}
GLES20(jint, glCreateShader)(JNIEnv*, jclass, jint kind) {
  return static_cast<jint>(glCreateShader(word(kind)));
}
GLES20(void, source)(JNIEnv* env, jclass, jint shader, jstring text) {
  const std::string copy = text_of(env, text);
  const char* letters = copy.c_str();
  glShaderSource(word(shader), 1, &letters, nullptr);
}
GLES20(void, glCompileShader)(JNIEnv*, jclass, jint shader) {
  glCompileShader(word(shader));
  GLint good = 0;
  glGetShaderiv(word(shader), GL_COMPILE_STATUS, &good);
  if (good == 0) std::abort();
}
GLES20(void, glAttachShader)(JNIEnv*, jclass, jint program, jint shader) {
  glAttachShader(word(program), word(shader));
}
GLES20(void, glDeleteShader)(JNIEnv*, jclass, jint shader) {
  glDeleteShader(word(shader));
}
GLES20(void, glBindAttribLocation)(JNIEnv* env, jclass, jint program, jint index, jstring name) {
  glBindAttribLocation(word(program), word(index), text_of(env, name).c_str());
}
GLES20(void, glLinkProgram)(JNIEnv*, jclass, jint program) {
  glLinkProgram(word(program));
}
GLES20(void, glUseProgram)(JNIEnv*, jclass, jint program) {
  glUseProgram(word(program));
}
GLES20(jint, glGetUniformLocation)(JNIEnv* env, jclass, jint program, jstring name) {
  return glGetUniformLocation(word(program), text_of(env, name).c_str());
}
GLES20(void, glUniformMatrix4fv)
(JNIEnv* env, jclass, jint at, jint count, jboolean turned, jfloatArray values, jint offset) {
  std::array<jfloat, 16> matrix{};
  env->GetFloatArrayRegion(values, offset, 16, matrix.data());
  glUniformMatrix4fv(at, count, turned, matrix.data());
}
GLES20(void, glGenTextures)(JNIEnv* env, jclass, jint, jintArray names, jint offset) {
  GLuint name = 0;
  glGenTextures(1, &name);
  give(env, names, offset, name);
}
GLES20(void, glGenFramebuffers)(JNIEnv* env, jclass, jint, jintArray names, jint offset) {
  GLuint name = 0;
  glGenFramebuffers(1, &name);
  give(env, names, offset, name);
}
GLES20(void, glBindTexture)(JNIEnv*, jclass, jint target, jint name) {
  glBindTexture(target_of(target), word(name));
}
GLES20(void, glTexParameteri)(JNIEnv*, jclass, jint target, jint name, jint value) {
  glTexParameteri(target_of(target), word(name), value);
}
GLES20(void, glTexImage2D)
(JNIEnv* env, jclass, jint target, jint level, jint inside, jint width, jint height, jint border,
 jint format, jint type, jobject pixels) {
  const void* bytes = pixels == nullptr ? nullptr : env->GetDirectBufferAddress(pixels);
  glTexImage2D(word(target), level, inside, width, height, border, word(format), word(type), bytes);
}
GLES20(void, glCopyTexImage2D)
(JNIEnv*, jclass, jint target, jint level, jint inside, jint x, jint y, jint width, jint height,
 jint border) {
  glCopyTexImage2D(target_of(target), level, word(inside), x, y, width, height, border);
}
GLES20(void, glDeleteTextures)(JNIEnv* env, jclass, jint, jintArray names, jint offset) {
  jint name = 0;
  env->GetIntArrayRegion(names, offset, 1, &name);
  const auto texture = static_cast<GLuint>(name);
  glDeleteTextures(1, &texture);
}
GLES20(void, glGetIntegerv)(JNIEnv* env, jclass, jint name, jintArray values, jint offset) {
  GLint value = 0;
  glGetIntegerv(word(name), &value);
  give(env, values, offset, word(value));
}
GLES20(void, glBindFramebuffer)(JNIEnv*, jclass, jint target, jint name) {
  glBindFramebuffer(word(target), word(name));
}
GLES20(void, glFramebufferTexture2D)
(JNIEnv*, jclass, jint target, jint at, jint kind, jint texture, jint level) {
  glFramebufferTexture2D(word(target), word(at), word(kind), word(texture), level);
}
GLES20(void, glViewport)(JNIEnv*, jclass, jint x, jint y, jint width, jint height) {
  glViewport(x, y, width, height);
}
GLES20(void, glDisable)(JNIEnv*, jclass, jint what) {
  glDisable(word(what));
}
GLES20(void, glColorMask)(JNIEnv*, jclass, jboolean r, jboolean g, jboolean b, jboolean a) {
  glColorMask(r, g, b, a);
}
GLES20(void, glActiveTexture)(JNIEnv*, jclass, jint unit) {
  glActiveTexture(word(unit));
}
GLES20(void, glBindBuffer)(JNIEnv*, jclass, jint target, jint name) {
  glBindBuffer(word(target), word(name));
}
GLES20(void, glEnableVertexAttribArray)(JNIEnv*, jclass, jint index) {
  glEnableVertexAttribArray(word(index));
}
GLES20(void, glDisableVertexAttribArray)(JNIEnv*, jclass, jint index) {
  glDisableVertexAttribArray(word(index));
}
GLES20(void, glVertexAttribPointer)
(JNIEnv* env, jclass, jint index, jint size, jint type, jboolean normal, jint stride,
 jobject values) {
  glVertexAttribPointer(word(index), size, word(type), normal, stride,
                        env->GetDirectBufferAddress(values));
}
GLES20(void, glDrawArrays)(JNIEnv*, jclass, jint mode, jint first, jint count) {
  glDrawArrays(word(mode), first, count);
}
