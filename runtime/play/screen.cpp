// Opens the context, draws, reads back.
#include "screen.hpp"

namespace modar {

Result<std::unique_ptr<Screen>> Screen::open(const BundleView& bundle, const PlayOptions& options) {
  std::unique_ptr<Screen> screen(new Screen(bundle));
  if (options.window) {
    auto window = Window::open("modar-play");
    if (!window) return tl::unexpected(window.error());
    screen->window_ = std::move(*window);
  } else {
    auto context = GlContext::create_offscreen();
    if (!context) return tl::unexpected(context.error());
    screen->context_ = std::move(*context);
  }
  GlCaps caps = probe_gl_caps();
  if (!options.device.empty()) {
    Result<GlCaps> masked = mask_gl_caps(caps, options.device);
    if (!masked) return tl::unexpected(masked.error());
    caps = *masked;
  }
  auto renderer = Renderer::create(bundle, caps);
  if (!renderer) return tl::unexpected(renderer.error());
  screen->renderer_ = std::move(*renderer);
  return screen;
}

Result<void> Screen::resize(int width, int height) {
  if (width == width_ && height == height_) return {};
  if (auto sized = renderer_->resize(width, height); !sized) return sized;
  width_ = width;
  height_ = height;
  rgba_.resize(std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  if (window_) window_->fit(width, height);
  return {};
}

void Screen::draw(const RgbImage& background, const Camera& camera,
                  std::span<const DrawItem> items) {
  glm::mat4 projection(1.0f);
  if (!items.empty()) {
    const DepthRange range = depth_range(bundle_, items);
    projection = gl_projection(camera, range.near_plane, range.far_plane);
  }
  renderer_->render(background, projection, items);
  if (window_) {
    renderer_->blit_to_window(window_->width(), window_->height());
    window_->swap();
  }
}

RgbaImage Screen::picture() {
  renderer_->read_pixels(rgba_);
  return {rgba_, width_, height_};
}

Canvas Screen::canvas() {
  return {rgba_, width_, height_};
}

}  // namespace modar
