// Drawing into a framebuffer of the app's: turned, mirrored, cropped, over its own picture, and its
// GL state left alone.
#include <functional>
#include <tuple>

#include <EGL/egl.h>
#include <GLES2/gl2.h>

#include <glm/gtc/matrix_transform.hpp>

#include "runtime/render/picture.hpp"
#include "tests/render/reference.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

constexpr int kWidth = 64;  // of the camera's frame
constexpr int kHeight = 48;
constexpr int kSurface = 80;  // both sides of the app's framebuffer

/// The app's own framebuffer, with a depth buffer, as a window's surface would be.
struct HostSurface {
  GLuint framebuffer = 0;
  GLuint colour = 0;
  GLuint depth = 0;
  HostSurface() {
    glGenTextures(1, &colour);
    glBindTexture(GL_TEXTURE_2D, colour);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, kSurface, kSurface, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                 nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glBindTexture(GL_TEXTURE_2D, 0);
    glGenRenderbuffers(1, &depth);
    glBindRenderbuffer(GL_RENDERBUFFER, depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT16, kSurface, kSurface);
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), GLenum{GL_FRAMEBUFFER_COMPLETE});
  }
  HostSurface(const HostSurface&) = delete;
  HostSurface& operator=(const HostSurface&) = delete;
  ~HostSurface() {
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteRenderbuffers(1, &depth);
    glDeleteTextures(1, &colour);
  }
  void clear(float r, float g, float b, float a) const {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glClearColor(r, g, b, a);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  }
  /// R, G, B, A, top row first.
  [[nodiscard]] std::vector<std::uint8_t> pixels() const {
    std::vector<std::uint8_t> rows(std::size_t{kSurface} * kSurface * 4);
    std::vector<std::uint8_t> result(rows.size());
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glReadPixels(0, 0, kSurface, kSurface, GL_RGBA, GL_UNSIGNED_BYTE, rows.data());
    constexpr std::ptrdiff_t kRow = kSurface * 4;
    for (int y = 0; y < kSurface; ++y) {
      std::copy_n(rows.begin() + y * kRow, kRow, result.begin() + (kSurface - 1 - y) * kRow);
    }
    return result;
  }
};

Camera frame_camera() {
  Camera camera = default_camera(kWidth, kHeight);
  camera.fx = 60;
  camera.fy = 57;
  camera.cx = 29.3;
  camera.cy = 25.1;
  return camera;
}

/// A few triangles without any symmetry.
std::vector<Triangle> some_triangles() {
  std::vector<Triangle> triangles(3);
  triangles[0].corners = {glm::dvec3(-1, -0.75, 0), {0.5, -0.5, 0.25}, {-0.5, 0.75, -0.25}};
  triangles[0].colour = {250, 20, 30};
  triangles[1].corners = {glm::dvec3(0.25, 0, 0.5), {1, 0.25, 0}, {0.5, 1, 0}};
  triangles[1].colour = {10, 240, 60};
  // Seen from behind: culled, whatever mirrors.
  triangles[2].corners = {glm::dvec3(0.5, -1, 0), {0.25, -0.25, 0}, {1, -0.75, 0}};
  triangles[2].colour = {30, 60, 250};
  return triangles;
}

glm::dmat4 tilted_view() {
  return glm::rotate(glm::translate(glm::dmat4(1.0), glm::dvec3(0.1, 0.05, -2.25)), 0.4,
                     glm::normalize(glm::dvec3(0.2, 1.0, 0.1)));
}

struct Pixel {
  int x = 0;
  int y = 0;
};

/// Where a pixel of the frame is after the turn, computed here: no matrix of the renderer's.
Pixel turned(Pixel frame, int rotation, bool mirror) {
  Pixel p = frame;
  if (rotation == 90) p = {kHeight - 1 - frame.y, frame.x};
  if (rotation == 180) p = {kWidth - 1 - frame.x, kHeight - 1 - frame.y};
  if (rotation == 270) p = {frame.y, kWidth - 1 - frame.x};
  const int width = rotation % 180 == 0 ? kWidth : kHeight;
  if (mirror) p.x = width - 1 - p.x;
  return p;
}

/// A viewport as wide as the turned frame and higher (bars), or as high and narrower (cropped).
SurfaceView surface_of(int rotation, bool mirror, bool cover) {
  const bool sideways = rotation % 180 != 0;
  const int width = sideways ? kHeight : kWidth;
  const int height = sideways ? kWidth : kHeight;
  if (cover) return {9, 5, width - 12, height, rotation, mirror, true, true};
  return {7, 3, width, height + 6, rotation, mirror, false, true};
}

/// Where a pixel of the frame is on that surface, from its top left; x < 0 where it is cropped.
Pixel on_surface(const SurfaceView& surface, Pixel frame) {
  Pixel p = turned(frame, surface.rotation, surface.mirror);
  p.x -= surface.cover ? 6 : 0;
  p.y += surface.cover ? 0 : 3;
  if (p.x < 0 || p.x >= surface.width) return {-1, -1};
  return {surface.x + p.x, kSurface - surface.y - surface.height + p.y};
}

class SurfaceTest : public GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    SceneMaker maker;
    MaterialRecord material = flat_material();
    material.flags = static_cast<decltype(material.flags)>(material.flags & ~kMaterialTwoSided);
    const std::uint32_t layout = maker.add_layout(Layout::kF32Coloured);
    const std::uint32_t one_sided = maker.add_material(material);
    triangles_ = some_triangles();
    maker.add_model(layout, {{{triangles_}, {0.0f}, one_sided, std::nullopt}});
    material.opacity = 0.5f;
    const std::uint32_t glass = maker.add_material(material);
    maker.add_model(layout, {{{triangles_}, {0.0f}, glass, std::nullopt}});
    std::vector<Triangle> gray = triangles_;
    for (Triangle& triangle : gray) triangle.colour = {200, 200, 200};
    maker.add_model(layout, {{{gray}, {0.0f}, one_sided, std::nullopt}});
    bundle_ = std::make_unique<MappedBundle>(maker.content);
    renderer_ = make_renderer(*bundle_->view, probe_gl_caps());
    ASSERT_TRUE(renderer_);
    host_ = std::make_unique<HostSurface>();
    hits_ = cast_rays(frame_camera(), to_eye_space(triangles_, tilted_view(), false));
    for (std::size_t i = 0; i < picture_.size(); ++i) {
      picture_[i] = static_cast<std::uint8_t>(i * 37 % 251);
    }
  }
  void TearDown() override {
    host_.reset();
    renderer_.reset();
    bundle_.reset();
  }

  [[nodiscard]] CameraPicture frame(bool with_picture) const {
    CameraPicture frame;
    frame.width = kWidth;
    frame.height = kHeight;
    frame.planes[0] = with_picture ? picture_.data() : nullptr;
    frame.strides[0] = 3 * kWidth;
    return frame;
  }
  void draw(const SurfaceView& surface, bool with_picture, std::uint32_t model = 0) {
    const DrawItem items[] = {{model, glm::mat4(tilted_view())}};
    host_->clear(0.2f, 0.4f, 0.6f, 1.0f);
    renderer_->draw(surface, frame(with_picture), gl_projection(frame_camera(), 0.1, 100.0), items);
  }
  [[nodiscard]] Rgb expected(std::size_t i, bool with_picture) const {
    if (hits_[i].triangle >= 0)
      return triangles_[static_cast<std::size_t>(hits_[i].triangle)].colour;
    if (with_picture) return {picture_[3 * i], picture_[3 * i + 1], picture_[3 * i + 2]};
    return {51, 102, 153};
  }

  void expect_surface(const SurfaceView& surface, bool with_picture) {
    const std::vector<std::uint8_t> pixels = host_->pixels();
    std::vector<bool> of_frame(std::size_t{kSurface} * kSurface, false);
    int models = 0;
    int wrong = 0;
    for (std::size_t i = 0; i < hits_.size(); ++i) {
      const int row = static_cast<int>(i) / kWidth;
      const Pixel p = on_surface(surface, {static_cast<int>(i) % kWidth, row});
      if (p.x < 0) continue;
      const std::size_t place = static_cast<std::size_t>(p.y * kSurface + p.x);
      of_frame[place] = true;
      if (!hits_[i].certain) continue;
      models += hits_[i].triangle >= 0;
      const Rgb colour = expected(i, with_picture);
      for (std::size_t c = 0; c < 3; ++c) {
        wrong += std::abs(pixels[4 * place + c] - colour[c]) > 2;
      }
    }
    EXPECT_EQ(wrong, 0) << "rotation " << surface.rotation << (surface.mirror ? " mirrored" : "")
                        << (surface.cover ? " cropped" : "")
                        << (with_picture ? " with" : " without") << " picture";
    EXPECT_GT(models, 200);
    int outside = 0;
    for (std::size_t i = 0; i < of_frame.size(); ++i) {
      outside += !of_frame[i] && pixels[4 * i] != 51;
    }
    EXPECT_EQ(outside, 0) << "the rest of the surface is the app's";
  }

  std::vector<Triangle> triangles_;
  std::vector<Hit> hits_;
  std::array<std::uint8_t, std::size_t{3} * kWidth * kHeight> picture_{};
  std::unique_ptr<MappedBundle> bundle_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<HostSurface> host_;
};

TEST_F(SurfaceTest, TurnsMirrorsFitsAndCropsAsTheRaysSay) {
  for (const int rotation : {0, 90, 180, 270}) {
    for (const bool mirror : {false, true}) {
      for (const bool cover : {false, true}) {
        for (const bool with_picture : {false, true}) {
          const SurfaceView surface = surface_of(rotation, mirror, cover);
          draw(surface, with_picture);
          expect_surface(surface, with_picture);
        }
      }
    }
  }
}

TEST_F(SurfaceTest, ATouchFindsTheFramesPixel) {
  for (const int rotation : {0, 90, 180, 270}) {
    for (const bool mirror : {false, true}) {
      for (const bool cover : {false, true}) {
        const SurfaceView surface = surface_of(rotation, mirror, cover);
        const Pixel p = on_surface(surface, {20, 19});
        const glm::dvec2 touch(p.x - surface.x + 0.5,
                               p.y - (kSurface - surface.y - surface.height) + 0.5);
        const glm::dvec2 pixel = frame_pixel(surface, kWidth, kHeight, touch);
        EXPECT_NEAR(pixel.x, 20, 1e-5) << rotation << mirror << cover;
        EXPECT_NEAR(pixel.y, 19, 1e-5) << rotation << mirror << cover;
      }
    }
  }
}

TEST_F(SurfaceTest, AlphaIsTheCoverageOfTheModels) {
  const SurfaceView surface{0, 0, kWidth, kHeight, 0, false, false, true};
  const DrawItem items[] = {{1, glm::mat4(tilted_view())}};
  host_->clear(0, 0, 0, 0);
  renderer_->draw(surface, frame(false), gl_projection(frame_camera(), 0.1, 100.0), items);
  const std::vector<std::uint8_t> pixels = host_->pixels();
  int compared = 0;
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    if (!hits_[i].certain) continue;
    const std::size_t row = i / kWidth + kSurface - kHeight;
    const std::uint8_t* pixel = &pixels[(row * kSurface + i % kWidth) * 4];
    // Half of it, premultiplied; nothing next to the model.
    const bool model = hits_[i].triangle >= 0;
    EXPECT_NEAR(pixel[3], model ? 128 : 0, 1);
    EXPECT_NEAR(pixel[0], model ? expected(i, false)[0] / 2 : 0, 2);
    ++compared;
  }
  EXPECT_GT(compared, 2000);
}

TEST_F(SurfaceTest, TwoBundlesShareOneFrameAndItsDepth) {
  const auto second = make_renderer(*bundle_->view, probe_gl_caps());
  SurfaceView surface{0, kSurface - kHeight, kWidth, kHeight, 0, false, false, true};
  draw(surface, true);
  const std::vector<std::uint8_t> first = host_->pixels();
  // The same in gray, a little farther away: what the first covers stays.
  const glm::mat4 away = glm::translate(glm::mat4(1.0f), glm::vec3(0, 0, -0.5f));
  const DrawItem behind[] = {{2, away * glm::mat4(tilted_view())}};
  surface.clear_depth = false;
  second->draw(surface, frame(false), gl_projection(frame_camera(), 0.1, 100.0), behind);
  const std::vector<std::uint8_t> both = host_->pixels();
  int changed = 0;
  int lost = 0;
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    const std::size_t at = (i / kWidth * kSurface + i % kWidth) * 4;
    const bool same = std::equal(&first[at], &first[at] + 4, &both[at]);
    lost += hits_[i].certain && hits_[i].triangle >= 0 && !same;
    changed += !same;
  }
  EXPECT_EQ(lost, 0);
  EXPECT_GT(changed, 0) << "the second bundle's model shows next to the first's";
}

bool is_es3() {
  return probe_gl_caps().version.starts_with("OpenGL ES 3");
}

/// All that GL answers of what the renderer may touch.
std::vector<GLint> host_state() {
  std::vector<GLint> state;
  std::vector<GLenum> names = {GL_FRAMEBUFFER_BINDING,
                               GL_RENDERBUFFER_BINDING,
                               GL_CURRENT_PROGRAM,
                               GL_ARRAY_BUFFER_BINDING,
                               GL_ELEMENT_ARRAY_BUFFER_BINDING,
                               GL_ACTIVE_TEXTURE,
                               GL_BLEND,
                               GL_CULL_FACE,
                               GL_DEPTH_TEST,
                               GL_SCISSOR_TEST,
                               GL_STENCIL_TEST,
                               GL_POLYGON_OFFSET_FILL,
                               GL_BLEND_EQUATION_RGB,
                               GL_BLEND_EQUATION_ALPHA,
                               GL_BLEND_SRC_RGB,
                               GL_BLEND_DST_RGB,
                               GL_BLEND_SRC_ALPHA,
                               GL_BLEND_DST_ALPHA,
                               GL_CULL_FACE_MODE,
                               GL_FRONT_FACE,
                               GL_DEPTH_FUNC,
                               GL_DEPTH_WRITEMASK,
                               GL_UNPACK_ALIGNMENT,
                               GL_PACK_ALIGNMENT,
                               GL_TEXTURE_BINDING_2D};
  // Of ES 3: vertex array, pixel buffers, row length and skips, sampler.
  if (is_es3()) {
    names.insert(names.end(), {0x85B5, 0x88ED, 0x88EF, 0x0CF2, 0x0CF3, 0x0CF4, 0x8919});
  }
  for (const GLenum name : names) {
    GLint value = 0;
    glGetIntegerv(name, &value);
    state.push_back(value);
  }
  for (const GLenum name : std::initializer_list<GLenum>{
           GL_VIEWPORT, GL_SCISSOR_BOX, GL_COLOR_WRITEMASK, GL_COLOR_CLEAR_VALUE}) {
    GLint values[4] = {};
    glGetIntegerv(name, values);
    state.insert(state.end(), values, values + 4);
  }
  for (GLuint i = 0; i < 8 && is_es3(); ++i) {
    GLint value = 0;
    glGetVertexAttribiv(i, GL_VERTEX_ATTRIB_ARRAY_ENABLED, &value);
    state.push_back(value);
    glGetVertexAttribiv(i, GL_VERTEX_ATTRIB_ARRAY_BUFFER_BINDING, &value);
    state.push_back(value);
  }
  EXPECT_EQ(glGetError(), GLenum{GL_NO_ERROR});
  return state;
}

template <class Function>
Function es3_function(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

/// What an app may have set: everything is another than a new context has it.
class Host {
 public:
  Host() {
    glGenTextures(1, &texture_);
    glGenBuffers(3, buffers_);
    glBindTexture(GL_TEXTURE_2D, texture_);
    if (is_es3()) {
      GLuint vertex_array = 0;
      GLuint sampler = 0;
      es3_function<void (*)(GLsizei, GLuint*)>("glGenVertexArrays")(1, &vertex_array);
      es3_function<void (*)(GLuint)>("glBindVertexArray")(vertex_array);
      es3_function<void (*)(GLsizei, GLuint*)>("glGenSamplers")(1, &sampler);
      es3_function<void (*)(GLuint, GLuint)>("glBindSampler")(0, sampler);
      glBindBuffer(0x88EC, buffers_[1]);  // uploads would read from it
      glPixelStorei(0x0CF2, 7);
    }
    const float corner[8] = {};
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[0]);
    glBufferData(GL_ARRAY_BUFFER, sizeof corner, corner, GL_STATIC_DRAW);
    if (is_es3()) glEnableVertexAttribArray(1);
    glVertexAttribPointer(1, 2, GL_FLOAT, GL_FALSE, 8, nullptr);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers_[2]);
    glViewport(1, 2, 33, 44);
    glScissor(3, 4, 5, 6);
    glEnable(GL_BLEND);
    glEnable(GL_CULL_FACE);
    glEnable(GL_SCISSOR_TEST);
    glCullFace(GL_FRONT);
    glFrontFace(GL_CW);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_FALSE);
    glColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
    glBlendFuncSeparate(GL_ONE, GL_ZERO, GL_DST_ALPHA, GL_ONE);
    glBlendEquation(GL_FUNC_SUBTRACT);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 2);
    glActiveTexture(GL_TEXTURE2);
  }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;
  ~Host() {
    if (is_es3()) {
      es3_function<void (*)(GLuint)>("glBindVertexArray")(0);
      es3_function<void (*)(GLuint, GLuint)>("glBindSampler")(0, 0);
      glBindBuffer(0x88EC, 0);
      glPixelStorei(0x0CF2, 0);
    }
    glDisable(GL_SCISSOR_TEST);
    glActiveTexture(GL_TEXTURE0);
    glDeleteTextures(1, &texture_);
    glDeleteBuffers(3, buffers_);
  }

 private:
  GLuint texture_ = 0;
  GLuint buffers_[3] = {};
};

TEST_F(SurfaceTest, TheAppsStateIsAsItWas) {
  host_->clear(0, 0, 0, 1);
  const Host app;
  const std::vector<GLint> before = host_state();
  const DrawItem items[] = {{0, glm::mat4(tilted_view())}};
  const glm::mat4 projection = gl_projection(frame_camera(), 0.1, 100.0);
  const auto expect_unchanged = [&](const char* what, const std::function<void()>& call) {
    call();
    EXPECT_EQ(glGetError(), GLenum{GL_NO_ERROR}) << what;
    EXPECT_EQ(host_state(), before) << what;
  };
  std::vector<std::uint8_t> pixels(std::size_t{kWidth} * kHeight * 4);
  std::unique_ptr<Renderer> another;
  expect_unchanged("create", [&] { another = make_renderer(*bundle_->view, probe_gl_caps()); });
  expect_unchanged(
      "draw", [&] { another->draw(surface_of(90, false, true), frame(true), projection, items); });
  expect_unchanged("resize", [&] { ASSERT_TRUE(another->resize(kWidth, kHeight)); });
  expect_unchanged("render", [&] { another->render(frame(true), projection, items); });
  expect_unchanged("read", [&] { another->read_pixels(pixels); });
  expect_unchanged("blit", [&] { another->blit_to_window(kSurface, kSurface); });
  // The read pixels are the picture, whatever the app had set.
  int wrong = 0;
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    wrong += hits_[i].certain && std::abs(pixels[4 * i] - expected(i, true)[0]) > 2;
  }
  EXPECT_EQ(wrong, 0);
}

TEST_F(SurfaceTest, AContextOfItsOwnFromNowOnShowsTheSame) {
  const SurfaceView surface = surface_of(0, false, false);
  // This frame ends by unbinding all: the next one must not rely on what it had bound.
  draw(surface, true);
  RenderOptions options;
  options.exclusive_context = true;
  renderer_->set_options(options);
  draw(surface, true);
  expect_surface(surface, true);
}

/// Mean difference of the picture from one of eight times its sides, each of whose blocks is
/// averaged.
double difference_from_fine(Renderer& renderer, int samples) {
  constexpr int kFiner = 8;
  const DrawItem items[] = {{0, glm::mat4(tilted_view())}};
  RenderOptions options = flat_light();
  const auto picture = [&](int factor, int asked) {
    options.samples = asked;
    renderer.set_options(options);
    Camera camera = frame_camera();
    camera.width *= factor;
    camera.height *= factor;
    camera.fx *= factor;
    camera.fy *= factor;
    camera.cx = (camera.cx + 0.5) * factor - 0.5;
    camera.cy = (camera.cy + 0.5) * factor - 0.5;
    return draw(renderer, camera, items);
  };
  const auto fine = picture(kFiner, 1);
  const auto pixels = picture(1, samples);
  double sum = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double mean = 0;
      for (int j = 0; j < kFiner; ++j) {
        for (int i = 0; i < kFiner; ++i) {
          const int at = 4 * ((y * kFiner + j) * kWidth * kFiner + x * kFiner + i);
          mean += fine[static_cast<std::size_t>(at)] / double{kFiner * kFiner};
        }
      }
      sum += std::fabs(pixels[static_cast<std::size_t>(4 * (y * kWidth + x))] - mean);
    }
  }
  return sum / (kWidth * kHeight);
}

TEST_F(SurfaceTest, SamplesSmoothEdges) {
  if (probe_gl_caps().max_samples < 4) GTEST_SKIP() << "a driver of one sample";
  const double stairs = difference_from_fine(*renderer_, 1);
  const double smooth = difference_from_fine(*renderer_, 4);
  EXPECT_GT(stairs, 1.0);
  EXPECT_LT(smooth, 0.5 * stairs);
  // Back to one sample at the same size.
  EXPECT_EQ(difference_from_fine(*renderer_, 1), stairs);
  GlCaps lower = probe_gl_caps();
  lower.max_samples = 1;
  const auto other = make_renderer(*bundle_->view, lower);
  ASSERT_TRUE(other);
  EXPECT_EQ(difference_from_fine(*other, 4), stairs);
}

/// Mesa's software driver has no GL_EXT_multisampled_render_to_texture: the queries to such a
/// driver, over calls of one sample.
int asked_of_texture = 0;
int asked_of_depth = 0;

TEST_F(SurfaceTest, SamplesThatATextureTakesByItself) {
  GlCaps caps = probe_gl_caps();
  caps.max_samples = 4;
  GlExtensions extensions;
  extensions.framebuffer_texture_multisample = [](GLenum target, GLenum place, GLenum kind,
                                                  GLuint texture, GLint level, GLsizei samples) {
    asked_of_texture = samples;
    glFramebufferTexture2D(target, place, kind, texture, level);
  };
  extensions.renderbuffer_storage_multisample = [](GLenum target, GLsizei samples, GLenum format,
                                                   GLsizei width, GLsizei height) {
    asked_of_depth = samples;
    glRenderbufferStorage(target, format, width, height);
  };
  GlState gl;
  Target target;
  while (glGetError() != GL_NO_ERROR) {
  }
  ASSERT_TRUE(target.resize(kWidth, kHeight, 8, caps, extensions, gl));
  EXPECT_EQ(asked_of_texture, 4);
  EXPECT_EQ(asked_of_depth, 4);
  target.begin();
  glClearColor(0.2f, 0.4f, 0.6f, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  target.finish(extensions);
  target.bind();
  std::array<std::uint8_t, 4> pixel{};
  glReadPixels(3, 5, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel.data());
  EXPECT_EQ(pixel, (std::array<std::uint8_t, 4>{51, 102, 153, 255}));
  target.release(gl);
  // A driver that refuses what it offers: one sample is drawn with.
  extensions.framebuffer_texture_multisample = [](GLenum, GLenum, GLenum, GLuint, GLint, GLsizei) {
  };
  EXPECT_TRUE(target.resize(kWidth, kHeight, 4, caps, extensions, gl));
  EXPECT_EQ(glGetError(), GLenum{GL_NO_ERROR});
  target.release(gl);
}

TEST_F(SurfaceTest, NoPictureNeverStretches) {
  ASSERT_TRUE(renderer_->resize(kWidth, 2 * kHeight));
  const DrawItem items[] = {{0, glm::mat4(tilted_view())}};
  renderer_->render(frame(false), gl_projection(frame_camera(), 0.1, 100.0), items);
  std::vector<std::uint8_t> pixels(std::size_t{kWidth} * 2 * kHeight * 4);
  renderer_->read_pixels(pixels);
  int wrong = 0;
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    if (!hits_[i].certain) continue;
    const int red = hits_[i].triangle < 0 ? 0 : expected(i, false)[0];
    // The frame's rows are in the middle.
    wrong += std::abs(pixels[4 * (i + std::size_t{kWidth} * kHeight / 2)] - red) > 1;
  }
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace modar
