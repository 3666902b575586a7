// Opens the context, draws, reads back.
#include "screen.hpp"

#include <algorithm>
#include <cstring>

#include <GLES2/gl2.h>

namespace modar {
namespace {

/// Light enough for a shadow to be seen, and no colour that the model could be thought to have.
constexpr glm::vec4 kTurntableGround{0.86f, 0.86f, 0.85f, 1.0f};

/// Samples per pixel, if the driver supports them. What GPUs of phones average on the way to
/// memory, nearly for nothing; eight are seldom there.
constexpr int kSamples = 4;

}  // namespace

Result<std::unique_ptr<Screen>> Screen::open(const BundleView& bundle, const PlayOptions& options) {
  std::unique_ptr<Screen> screen(new Screen(bundle, options));
  if (options.window) {
    MODAR_ASSIGN(auto window, Window::open("modar-play"));
    screen->window_ = std::move(window);
  } else {
    MODAR_ASSIGN(auto context, GlContext::create_offscreen());
    screen->context_ = std::move(context);
  }
  MODAR_TRY(screen->read_caps());
  MODAR_TRY(screen->load(bundle));
  return screen;
}

Result<void> Screen::load(const BundleView& bundle) {
  MODAR_ASSIGN(auto renderer, Renderer::create(bundle, caps_));
  RenderOptions drawing;
  drawing.exclusive_context = true;
  drawing.samples = kSamples;
  drawing.estimate_light = !options_.no_light_estimate;
  if (options_.turntable > 0) drawing.clear_colour = kTurntableGround;
  renderer->set_options(drawing);
  if (width_ > 0) MODAR_TRY(renderer->resize(width_, height_));
  renderer_ = std::move(renderer);
  bundle_ = bundle;
  for (const Video& video : videos_) glDeleteTextures(1, &video.texture);
  videos_.clear();
  return {};
}

Result<void> Screen::read_caps() {
  caps_ = probe_gl_caps();
  if (!options_.device.empty()) {
    MODAR_ASSIGN(GlCaps masked, mask_gl_caps(caps_, options_.device));
    caps_ = masked;
  }
  if (options_.gpu_budget > 0) caps_.gpu_memory = options_.gpu_budget;
  return {};
}

Result<void> Screen::resize(int width, int height) {
  if (window_ && window_->take_loss()) {
    MODAR_TRY(window_->renew());
    MODAR_TRY(read_caps());
    MODAR_TRY(renderer_->restore(caps_));
    videos_.clear();
  }
  if (width == width_ && height == height_) return {};
  MODAR_TRY(renderer_->resize(width, height));
  width_ = width;
  height_ = height;
  rgba_.resize(std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (window_) window_->fit(width, height);
  return {};
}

namespace {

CameraPicture picture_of(const RgbImage& image) {
  CameraPicture picture;
  picture.width = image.width;
  picture.height = image.height;
  picture.planes[0] = image.pixels;
  picture.strides[0] = image.stride;
  return picture;
}

}  // namespace

void keep_changed_rows(const CameraPicture& before, CameraPicture& now) {
  if (before.width != now.width || before.height != now.height || before.format != now.format) {
    return;
  }
  const auto same = [&](int row) {
    for (std::size_t p = 0; p < now.planes.size() && now.planes[p] != nullptr; ++p) {
      const std::ptrdiff_t stride = now.strides[p];
      const std::ptrdiff_t at = stride * (p == 0 ? row : row / 2);
      if (std::memcmp(before.planes[p] + at, now.planes[p] + at,
                      static_cast<std::size_t>(stride)) != 0) {
        return false;
      }
    }
    return true;
  };
  int end = now.height;
  while (end > 0 && same(end - 1)) --end;
  now.first_row = 0;
  while (now.first_row < end && same(now.first_row)) ++now.first_row;
  now.row_count = end - now.first_row;
}

void Screen::draw(const CameraPicture& background, const Camera& camera,
                  std::span<const DrawItem> items, const CameraPicture& before) {
  CameraPicture shown = background;
  if (!painted_) keep_changed_rows(before, shown);
  painted_ = false;
  glm::mat4 projection(1.0f);
  if (!items.empty()) {
    const DepthRange range = depth_range(bundle_, items);
    projection = gl_projection(camera, range.near_plane, range.far_plane);
  }
  renderer_->render(shown, projection, items);
  stats_ = renderer_->stats();
  uploads_.bytes += stats_.bytes_uploaded;
  uploads_.same += stats_.bytes_same;
}

bool Screen::has_video(std::uint32_t node) const {
  return std::any_of(videos_.begin(), videos_.end(),
                     [node](const Video& video) { return video.node == node; });
}

void Screen::show_video(std::uint32_t node, const RgbImage& image) {
  GLint bound = 0;  // the renderer continues from the state that it left
  glGetIntegerv(GL_TEXTURE_BINDING_2D, &bound);
  auto video = std::find_if(videos_.begin(), videos_.end(),
                            [node](const Video& each) { return each.node == node; });
  if (video == videos_.end()) {
    video = videos_.insert(videos_.end(), Video{node, 0, {}, {}});
    glGenTextures(1, &video->texture);
    glBindTexture(GL_TEXTURE_2D, video->texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    renderer_->set_video(node, video->texture);
  }
  glBindTexture(GL_TEXTURE_2D, video->texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  CameraPicture& last = video->picture;
  CameraPicture now = picture_of(image);
  keep_changed_rows(last, now);
  const auto row = static_cast<std::size_t>(image.stride);
  const std::size_t first = static_cast<std::size_t>(now.first_row) * row;
  std::size_t bytes = static_cast<std::size_t>(image.height) * row;
  if (now.row_count <= now.height) {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, now.first_row, now.width, now.row_count, GL_RGB,
                    GL_UNSIGNED_BYTE, image.pixels + first);
    uploads_.same += bytes;
    bytes = static_cast<std::size_t>(now.row_count) * row;
    uploads_.same -= bytes;
  } else {
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB, image.width, image.height, 0, GL_RGB, GL_UNSIGNED_BYTE,
                 image.pixels);
    video->pixels.resize(bytes);
  }
  uploads_.bytes += bytes;
  std::copy_n(image.pixels + first, bytes, video->pixels.data() + first);
  last = now;
  last.planes[0] = video->pixels.data();
  glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(bound));
}

void Screen::set_title(const std::string& title) {
  if (window_) window_->set_title(title);
}

RgbaView Screen::picture() {
  renderer_->read_pixels(rgba_);
  return {rgba_, width_, height_};
}

Canvas Screen::canvas() {
  return {rgba_, width_, height_};
}

RgbImage Screen::canvas_picture() {
  rgb_.resize(rgba_.size() / 4 * 3);
  for (std::size_t i = 0; i < rgb_.size() / 3; ++i) {
    for (std::size_t c = 0; c < 3; ++c) rgb_[3 * i + c] = rgba_[4 * i + c];
  }
  return {rgb_.data(), width_, height_, std::ptrdiff_t{3} * width_};
}

void Screen::draw_on_canvas(const Camera& camera, std::span<const DrawItem> items) {
  draw(picture_of(canvas_picture()), camera, items);
  painted_ = true;
}

void Screen::present() {
  if (!window_) return;
  renderer_->blit_to_window(window_->width(), window_->height());
  window_->swap();
}

void Screen::present_canvas() {
  if (!window_) return;
  renderer_->render(canvas_picture(), glm::mat4(1.0f), {});
  painted_ = true;
  present();
}

std::span<const UserAct> Screen::acts(std::chrono::milliseconds limit) {
  if (!window_) return {};
  return window_->acts(limit);
}

}  // namespace modar
