// The render thread's half: a context (window or off-screen), the renderer in it, and the picture.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "formats/bundle_view.hpp"
#include "frame_sink.hpp"
#include "modar/camera.hpp"
#include "modar/gl_context.hpp"
#include "modar/renderer.hpp"
#include "options.hpp"
#include "overlay.hpp"
#include "window.hpp"

namespace modar {

class Screen {
 public:
  /// Opens the context that the options ask for on this thread, and uploads the bundle.
  /// Errors: those of GlContext, Window, mask_gl_caps() and Renderer.
  static Result<std::unique_ptr<Screen>> open(const BundleView& bundle, const PlayOptions& options);
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Sets the picture's size; nothing happens where it stands already.
  Result<void> resize(int width, int height);
  /// Draws the background and the items as the camera sees them, and shows them in the window.
  void draw(const RgbImage& background, const Camera& camera, std::span<const DrawItem> items);
  /// Reads the picture back. The canvas of the same pixels may be painted on.
  RgbaImage picture();
  Canvas canvas();

  [[nodiscard]] const RenderStats& stats() const { return renderer_->stats(); }
  /// Answers false once the user ended the window.
  bool poll() { return !window_ || window_->poll(); }

 private:
  Screen(const BundleView& bundle) : bundle_(bundle) {}

  const BundleView& bundle_;
  std::unique_ptr<GlContext> context_;
  std::unique_ptr<Window> window_;
  std::unique_ptr<Renderer> renderer_;  ///< before its context goes
  std::vector<std::uint8_t> rgba_;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace modar
