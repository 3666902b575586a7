// An OpenGL ES 2.0 that draws nothing: what the renderer itself costs, without a driver
// (budget_probe.cpp). These calls answer as a healthy context does; scripts/foreign.sh makes all
// others return 0.
#include <GLES2/gl2.h>

namespace {

void name_all(GLsizei count, GLuint* names) {
  static GLuint next = 0;
  for (GLsizei i = 0; i < count; ++i) names[i] = ++next;
}

}  // namespace

extern "C" {

const GLubyte* glGetString(GLenum) {
  return reinterpret_cast<const GLubyte*>("");
}
GLenum glCheckFramebufferStatus(GLenum) {
  return GL_FRAMEBUFFER_COMPLETE;
}
GLuint glCreateProgram() {
  return 1;
}
GLuint glCreateShader(GLenum) {
  return 1;
}
void glGetIntegerv(GLenum, GLint* value) {
  *value = 0;
}
void glGetProgramiv(GLuint, GLenum, GLint* value) {
  *value = GL_TRUE;
}
void glGetShaderiv(GLuint, GLenum, GLint* value) {
  *value = GL_TRUE;
}
void glGenBuffers(GLsizei count, GLuint* names) {
  name_all(count, names);
}
void glGenFramebuffers(GLsizei count, GLuint* names) {
  name_all(count, names);
}
void glGenRenderbuffers(GLsizei count, GLuint* names) {
  name_all(count, names);
}
void glGenTextures(GLsizei count, GLuint* names) {
  name_all(count, names);
}

}  // extern "C"
