// host BUNDLE M0...M15 > rgba: an app with OpenGL ES 3 that has drawn its camera's picture by
// itself, into a multisampled framebuffer of its own, with a vertex array object that stays bound.
// Over it go the bundle's first model, as a frame of 160x120 from a sensor that is across shows
// it: turned by 90 degrees and cropped. M: model space to GL's eye space, column by column. Prints
// 170x250 pixels, the bottom row first.
#include <modar/mapped_file.hpp>
#include <modar/renderer.hpp>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES3/gl3.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

constexpr int kWidth = 170;
constexpr int kHeight = 250;

void need(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "host: %s\n", what);
  std::exit(9);
}

void make_context() {
  EGLDisplay display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
  if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) {
    const auto platform_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        eglGetProcAddress("eglGetPlatformDisplayEXT"));
    display = platform_display(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    need(eglInitialize(display, nullptr, nullptr) == EGL_TRUE, "no display");
  }
  const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                           EGL_OPENGL_ES3_BIT, EGL_NONE};
  const EGLint version[] = {EGL_CONTEXT_CLIENT_VERSION, 3, EGL_NONE};
  const EGLint size[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  need(eglChooseConfig(display, wanted, &config, 1, &count) == EGL_TRUE && count == 1,
       "no configuration");
  eglBindAPI(EGL_OPENGL_ES_API);
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
  const EGLSurface surface = eglCreatePbufferSurface(display, config, size);
  need(eglMakeCurrent(display, surface, surface, context) == EGL_TRUE, "no context of ES 3");
}

GLuint make_framebuffer(GLsizei samples) {
  GLuint framebuffer = 0;
  std::array<GLuint, 2> buffers{};
  glGenFramebuffers(1, &framebuffer);
  glGenRenderbuffers(2, buffers.data());
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glBindRenderbuffer(GL_RENDERBUFFER, buffers[0]);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_RGBA8, kWidth, kHeight);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffers[0]);
  glBindRenderbuffer(GL_RENDERBUFFER, buffers[1]);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, GL_DEPTH_COMPONENT24, kWidth, kHeight);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, buffers[1]);
  need(glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE, "no framebuffer");
  return framebuffer;
}

GLuint compile(GLenum kind, const char* text) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  return shader;
}

/// Red is the pixel's column, green its row from the bottom.
GLuint make_picture_program() {
  const GLuint program = glCreateProgram();
  glAttachShader(program, compile(GL_VERTEX_SHADER,
                                  "#version 300 es\nin vec2 corner;\n"
                                  "void main() { gl_Position = vec4(corner, 0.0, 1.0); }\n"));
  glAttachShader(
      program,
      compile(GL_FRAGMENT_SHADER,
              "#version 300 es\nprecision highp float;\nout vec4 colour;\n"
              "void main() { colour = vec4(floor(gl_FragCoord.xy) / 255.0, 0.5, 1.0); }\n"));
  glBindAttribLocation(program, 0, "corner");
  glLinkProgram(program);
  return program;
}

/// What the app expects to find as it left it.
std::array<GLint, 12> state() {
  std::array<GLint, 12> values{};
  glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &values[0]);
  glGetIntegerv(GL_CURRENT_PROGRAM, &values[1]);
  glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &values[2]);
  glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &values[3]);
  glGetIntegerv(GL_ARRAY_BUFFER_BINDING, &values[4]);
  glGetIntegerv(GL_DEPTH_TEST, &values[5]);
  glGetIntegerv(GL_CULL_FACE, &values[6]);
  glGetIntegerv(GL_BLEND, &values[7]);
  glGetIntegerv(GL_VIEWPORT, &values[8]);
  return values;
}

}  // namespace

int main(int argc, char** argv) {
  need(argc == 18, "host BUNDLE M0...M15");
  const auto file = modar::MappedFile::open(argv[1]);
  need(file.has_value(), "no file");
  const auto bundle = modar::BundleView::open(file->bytes());
  need(bundle.has_value(), "no bundle");
  modar::DrawItem item;
  for (int i = 0; i < 16; ++i)
    item.to_eye[i / 4][i % 4] = static_cast<float>(std::atof(argv[2 + i]));

  make_context();
  const GLuint plain = make_framebuffer(0);
  make_framebuffer(4);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, plain);
  glUseProgram(make_picture_program());
  GLuint vertex_array = 0;
  GLuint corners = 0;
  glGenVertexArrays(1, &vertex_array);
  glBindVertexArray(vertex_array);
  glGenBuffers(1, &corners);
  glBindBuffer(GL_ARRAY_BUFFER, corners);
  const float triangle[] = {-1, -1, 3, -1, -1, 3};
  glBufferData(GL_ARRAY_BUFFER, sizeof triangle, triangle, GL_STATIC_DRAW);
  glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
  glEnableVertexAttribArray(0);
  glViewport(0, 0, kWidth, kHeight);

  const auto before = state();
  const auto renderer = modar::Renderer::create(*bundle, modar::probe_gl_caps());
  need(renderer.has_value(), "no renderer");
  modar::Camera camera = modar::default_camera(160, 120);
  camera.fx = 150;
  camera.fy = 140;
  camera.cx = 75;
  camera.cy = 66;
  modar::CameraPicture frame;  // its size alone: the picture is there already
  frame.width = camera.width;
  frame.height = camera.height;
  const modar::SurfaceView surface{9, 4, 150, 240, 90, false, true, true};
  const modar::DepthRange range = modar::depth_range(*bundle, {&item, 1});
  for (int i = 0; i < 2; ++i) {
    // Without setting anything again: what the app had set still holds.
    glDrawArrays(GL_TRIANGLES, 0, 3);
    (*renderer)->draw(surface, frame,
                      modar::gl_projection(camera, range.near_plane, range.far_plane), {&item, 1});
    need(state() == before, "the app's state has changed");
  }
  glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(before[2]));
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, plain);
  glBlitFramebuffer(0, 0, kWidth, kHeight, 0, 0, kWidth, kHeight, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, plain);
  std::vector<unsigned char> rgba(static_cast<std::size_t>(4 * kWidth * kHeight));
  glReadPixels(0, 0, kWidth, kHeight, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  need(glGetError() == GL_NO_ERROR, "GL has an error");
  std::fwrite(rgba.data(), 1, rgba.size(), stdout);
  return 0;
}
