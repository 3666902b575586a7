// The off-screen framebuffer, and the camera's picture as textures, drawn as one rectangle.
#include "runtime/render/picture.hpp"

#include <algorithm>

#include "runtime/render/program.hpp"

namespace modar {
namespace {

constexpr GLenum kRgba8 = 0x8058;  // GL_RGBA8 of ES 3

}  // namespace

Result<void> Target::resize(int width, int height, int samples, const GlCaps& caps,
                            const GlExtensions& extensions, GlState& gl) {
  if (width == width_ && height == height_ && samples == asked_ && framebuffer_ != 0) return {};
  gl.reset();
  release(gl);
  if (width < 1 || height < 1 || width > caps.max_texture_size || height > caps.max_texture_size) {
    return fail(ExitCode::kUnsupported, "gl.framebuffer", "renderer",
                "this size of picture is not possible on this device",
                "ask for a smaller picture, of at least 1x1");
  }
  glGenTextures(1, &texture_);
  gl.edit_texture(0, texture_);
  // A texture, not a renderbuffer: those have at best 5-6-5 bits in ES 2.0 without extensions.
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  // The texture must not be read while it is drawn to.
  gl.bind_texture(0, 0);
  glGenRenderbuffers(1, &depth_);
  glGenFramebuffers(1, &framebuffer_);
  const GLenum depth_format =
      caps.depth24 ? GLenum{GL_DEPTH_COMPONENT24_OES} : GLenum{GL_DEPTH_COMPONENT16};
  const int most = std::min(samples, caps.max_samples);
  if (!(most > 1 && attach(width, height, most, depth_format, extensions)) &&
      !attach(width, height, 1, depth_format, extensions)) {
    release(gl);
    return fail(ExitCode::kUnsupported, "gl.framebuffer", "renderer",
                "the driver refuses a framebuffer of this size", "ask for a smaller picture");
  }
  width_ = width;
  height_ = height;
  asked_ = samples;
  return {};
}

/// Several samples go into the texture by themselves where the extension is, else into
/// renderbuffers that finish() averages. False where the driver refuses.
bool Target::attach(int width, int height, int samples, GLenum depth_format,
                    const GlExtensions& extensions) {
  const bool several = samples > 1;
  const bool by_itself = several && extensions.framebuffer_texture_multisample != nullptr;
  const auto store = [&](GLuint buffer, GLenum format) {
    glBindRenderbuffer(GL_RENDERBUFFER, buffer);
    if (several) {
      extensions.renderbuffer_storage_multisample(GL_RENDERBUFFER, samples, format, width, height);
    } else {
      glRenderbufferStorage(GL_RENDERBUFFER, format, width, height);
    }
  };
  if (several && extensions.renderbuffer_storage_multisample == nullptr) return false;
  if (several && !by_itself && extensions.blit_framebuffer == nullptr) return false;
  glDeleteFramebuffers(1, &drawn_);
  glDeleteRenderbuffers(1, &colour_);
  drawn_ = colour_ = 0;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  if (by_itself) {
    extensions.framebuffer_texture_multisample(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D,
                                               texture_, 0, samples);
  } else {
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
  }
  if (several && !by_itself) {
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, 0);
    glGenRenderbuffers(1, &colour_);
    store(colour_, kRgba8);
    glGenFramebuffers(1, &drawn_);
    begin();
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_);
  }
  store(depth_, depth_format);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_);
  return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

void Target::finish(const GlExtensions& extensions) const {
  if (drawn_ == 0) return;
  glBindFramebuffer(kReadFramebuffer, drawn_);
  glBindFramebuffer(kDrawFramebuffer, framebuffer_);
  extensions.blit_framebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT,
                              GL_NEAREST);
}

void Target::release(GlState& gl) {
  gl.forget_texture(texture_);
  glDeleteFramebuffers(1, &framebuffer_);
  glDeleteFramebuffers(1, &drawn_);
  glDeleteRenderbuffers(1, &colour_);
  glDeleteRenderbuffers(1, &depth_);
  glDeleteTextures(1, &texture_);
  *this = Target();
}

namespace {

/// How a plane is stored in GL.
struct PlaneLayout {
  GLenum format = GL_RGB;
  int bytes = 3;    ///< a pixel
  int divider = 1;  ///< of the picture's sides
};

struct Layouts {
  int count = 0;
  std::array<PlaneLayout, 3> planes;
};

Layouts layouts_of(PictureFormat format) {
  const PlaneLayout luma{GL_LUMINANCE, 1, 1};
  switch (format) {
    case PictureFormat::kNv21:
    case PictureFormat::kNv12:
      return {2, {luma, {GL_LUMINANCE_ALPHA, 2, 2}, {}}};
    case PictureFormat::kI420:
      return {3, {luma, {GL_LUMINANCE, 1, 2}, {GL_LUMINANCE, 1, 2}}};
    case PictureFormat::kRgba:
      return {1, {PlaneLayout{GL_RGBA, 4, 1}, {}, {}}};
    case PictureFormat::kRgb:
      break;
  }
  return {1, {PlaneLayout{}, {}, {}}};
}

/// Rows [first, end) of a plane, full width, into the bound texture.
void send_rows(const PlaneLayout& layout, const std::uint8_t* pixels, std::ptrdiff_t stride,
               int width, int first, int end) {
  const std::uint8_t* start = pixels + first * stride;
  if (stride == std::ptrdiff_t{layout.bytes} * width) {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, first, width, end - first, layout.format, GL_UNSIGNED_BYTE,
                    start);
  } else {
    // ES 2.0 cannot step over padding: row by row, without our own copy.
    for (int y = first; y < end; ++y, start += stride) {
      glTexSubImage2D(GL_TEXTURE_2D, 0, 0, y, width, 1, layout.format, GL_UNSIGNED_BYTE, start);
    }
  }
}

}  // namespace

Background::Kind Background::kind_of(PictureFormat format) {
  if (format == PictureFormat::kRgb || format == PictureFormat::kRgba) return kRgb;
  return format == PictureFormat::kI420 ? kPlanes : kPair;
}

Result<void> Background::create() {
  const float corners[] = {0, 0, 1, 0, 0, 1, 1, 1};
  glGenBuffers(1, &rectangle_);
  glBindBuffer(GL_ARRAY_BUFFER, rectangle_);
  glBufferData(GL_ARRAY_BUFFER, sizeof corners, corners, GL_STATIC_DRAW);
  return link(kRgb);
}

Result<void> Background::link(Kind kind) {
  constexpr std::array<const char*, kKinds> kDefines = {"", "#define CHROMA_PAIR\n",
                                                        "#define CHROMA_PLANES\n"};
  Program& program = programs_[kind];
  const Result<GLuint> linked =
      link_program(kDefines[kind], background_vertex_source(), background_fragment_source());
  program.failed = !linked.has_value();
  if (!linked) return tl::unexpected<Error>(linked.error());
  program.id = *linked;
  const auto place = [&](const char* name) { return glGetUniformLocation(program.id, name); };
  program.turn = place("u_turn");
  program.start = place("u_start");
  program.range = place("u_range");
  program.swap = place("u_swap");
  glUseProgram(program.id);
  glUniform1i(place("u_texture"), 0);
  glUniform1i(place("u_second"), 1);
  glUniform1i(place("u_third"), 2);
  return {};
}

void Background::release(GlState& gl) {
  for (const Plane& plane : planes_) {
    gl.forget_texture(plane.texture);
    glDeleteTextures(1, &plane.texture);
  }
  gl.forget_buffer(rectangle_);
  glDeleteBuffers(1, &rectangle_);
  for (const Program& program : programs_) glDeleteProgram(program.id);
  *this = Background();
}

void Background::allocate(const CameraPicture& picture, GlState& gl) {
  width_ = picture.width;
  height_ = picture.height;
  format_ = picture.format;
  const Layouts layouts = layouts_of(format_);
  for (int i = 0; i < layouts.count; ++i) {
    const PlaneLayout& layout = layouts.planes[static_cast<std::size_t>(i)];
    Plane& plane = planes_[static_cast<std::size_t>(i)];
    if (plane.texture == 0) glGenTextures(1, &plane.texture);
    plane.filter = 0;
    gl.edit_texture(static_cast<GLuint>(i), plane.texture);
    const int divider = layout.divider;
    glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(layout.format),
                 (width_ + divider - 1) / divider, (height_ + divider - 1) / divider, 0,
                 layout.format, GL_UNSIGNED_BYTE, nullptr);
    // ES 2.0 takes pictures that are no power of two only without mipmaps and clamped.
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  }
}

void Background::upload(const CameraPicture& picture, GlState& gl, RenderStats& stats) {
  const bool same =
      picture.width == width_ && picture.height == height_ && picture.format == format_;
  if (!same) allocate(picture, gl);
  full_range_ = picture.full_range;
  const int first = same ? std::clamp(picture.first_row, 0, height_) : 0;
  const int count = same ? std::clamp(picture.row_count, 0, height_ - first) : height_;
  const Layouts layouts = layouts_of(format_);
  for (int i = 0; i < layouts.count; ++i) {
    const std::size_t p = static_cast<std::size_t>(i);
    const int divider = layouts.planes[p].divider;
    const int width = (width_ + divider - 1) / divider;
    const int rows = (height_ + divider - 1) / divider;
    const int start = count > 0 ? first / divider : 0;
    const int end = count > 0 ? (first + count + divider - 1) / divider : 0;
    const auto row = static_cast<std::uint64_t>(layouts.planes[p].bytes * width);
    stats.bytes_uploaded += row * static_cast<std::uint64_t>(end - start);
    stats.bytes_same += row * static_cast<std::uint64_t>(rows - (end - start));
    if (start == end) continue;
    gl.edit_texture(static_cast<GLuint>(i), planes_[p].texture);
    send_rows(layouts.planes[p], picture.planes[p], picture.strides[p], width, start, end);
  }
}

/// Luma and RGB are taken unchanged where a texel is a pixel; chroma is always interpolated.
void Background::set_filters(bool exact, GlState& gl) {
  const int count = layouts_of(format_).count;
  for (int i = 0; i < count; ++i) {
    Plane& plane = planes_[static_cast<std::size_t>(i)];
    gl.bind_texture(static_cast<GLuint>(i), plane.texture);
    const GLint filter = exact && i == 0 ? GL_NEAREST : GL_LINEAR;
    if (filter == plane.filter) continue;
    plane.filter = filter;
    gl.edit_texture(static_cast<GLuint>(i), plane.texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  }
}

int Background::draw(bool exact, const TextureMap& map, GlState& gl) {
  const Kind kind = kind_of(format_);
  Program& program = programs_[kind];
  if (program.id == 0 && !program.failed) {
    // The format is seen for the first time.
    static_cast<void>(link(kind));
    gl.forget_program();
  }
  if (program.failed) return 0;
  set_filters(exact, gl);
  gl.use_program(program.id);
  if (kind != kRgb) {
    // ITU-R BT.601: 219 steps of luma from 16 and 224 of chroma where the range is limited.
    if (full_range_) {
      glUniform3f(program.range, 1.0f, 0.0f, 1.0f);
    } else {
      glUniform3f(program.range, 255.0f / 219.0f, -16.0f / 219.0f, 255.0f / 224.0f);
    }
    glUniform1f(program.swap, format_ == PictureFormat::kNv21 ? 1.0f : 0.0f);
  }
  return draw_rectangle(program, map, gl);
}

int Background::draw_texture(GLuint texture, GlState& gl) {
  gl.bind_texture(0, texture);
  return draw_rectangle(programs_[kRgb], {{1.0f, 0.0f, 0.0f, 1.0f}, {0.0f, 0.0f}}, gl);
}

int Background::draw_rectangle(const Program& program, const TextureMap& map, GlState& gl) {
  gl.use_program(program.id);
  gl.set_depth_test(false);
  gl.set_blending(false);
  gl.set_culling(false);
  gl.set_front_face(GL_CCW);
  gl.set_attribute(kAttributePosition, {rectangle_, 2, GL_FLOAT, GL_FALSE, 8, 0});
  gl.enable_attributes(1u << kAttributePosition);
  glUniform4fv(program.turn, 1, map.turn.data());
  glUniform2fv(program.start, 1, map.start.data());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  return 1;
}

}  // namespace modar
