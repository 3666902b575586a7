// Opens the context, draws, reads back.
#include "screen.hpp"

namespace modar {

Result<std::unique_ptr<Screen>> Screen::open(const BundleView& bundle, const PlayOptions& options) {
  std::unique_ptr<Screen> screen(new Screen(bundle, options));
  if (options.window) {
    auto window = Window::open("modar-play");
    if (!window) return tl::unexpected(window.error());
    screen->window_ = std::move(*window);
  } else {
    auto context = GlContext::create_offscreen();
    if (!context) return tl::unexpected(context.error());
    screen->context_ = std::move(*context);
  }
  if (auto read = screen->read_caps(); !read) return tl::unexpected(read.error());
  auto renderer = Renderer::create(bundle, screen->caps_);
  if (!renderer) return tl::unexpected(renderer.error());
  screen->renderer_ = std::move(*renderer);
  RenderOptions drawing;
  drawing.exclusive_context = true;
  screen->renderer_->set_options(drawing);
  return screen;
}

Result<void> Screen::read_caps() {
  caps_ = probe_gl_caps();
  if (!options_.device.empty()) {
    Result<GlCaps> masked = mask_gl_caps(caps_, options_.device);
    if (!masked) return tl::unexpected(masked.error());
    caps_ = *masked;
  }
  if (options_.gpu_budget > 0) caps_.gpu_memory = options_.gpu_budget;
  return {};
}

Result<void> Screen::resize(int width, int height) {
  if (window_ && window_->take_loss()) {
    if (auto renewed = window_->renew(); !renewed) return renewed;
    if (auto read = read_caps(); !read) return read;
    if (auto restored = renderer_->restore(caps_); !restored) return restored;
  }
  if (width == width_ && height == height_) return {};
  if (auto sized = renderer_->resize(width, height); !sized) return sized;
  width_ = width;
  height_ = height;
  rgba_.resize(std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (window_) window_->fit(width, height);
  return {};
}

void Screen::draw(const CameraPicture& background, const Camera& camera,
                  std::span<const DrawItem> items) {
  glm::mat4 projection(1.0f);
  if (!items.empty()) {
    const DepthRange range = depth_range(bundle_, items);
    projection = gl_projection(camera, range.near_plane, range.far_plane);
  }
  renderer_->render(background, projection, items);
  stats_ = renderer_->stats();
}

RgbaImage Screen::picture() {
  renderer_->read_pixels(rgba_);
  return {rgba_, width_, height_};
}

Canvas Screen::canvas() {
  return {rgba_, width_, height_};
}

void Screen::present() {
  if (!window_) return;
  renderer_->blit_to_window(window_->width(), window_->height());
  window_->swap();
}

void Screen::present_canvas() {
  if (!window_) return;
  rgb_.resize(rgba_.size() / 4 * 3);
  for (std::size_t i = 0; i < rgb_.size() / 3; ++i) {
    for (std::size_t c = 0; c < 3; ++c) rgb_[3 * i + c] = rgba_[4 * i + c];
  }
  renderer_->render({rgb_.data(), width_, height_, std::ptrdiff_t{3} * width_}, glm::mat4(1.0f),
                    {});
  present();
}

std::span<const UserAct> Screen::acts(std::chrono::milliseconds limit) {
  if (!window_) return {};
  return window_->acts(limit);
}

}  // namespace modar
