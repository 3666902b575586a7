// The render thread's half: a window or an off-screen context, the renderer in it, the picture, and
// what the user does in the window.
#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "controls.hpp"
#include "formats/base/error.hpp"
#include "formats/bundle_view.hpp"
#include "frame_report.hpp"
#include "frame_sink.hpp"
#include "modar/camera.hpp"
#include "modar/gl_context.hpp"
#include "modar/renderer.hpp"
#include "options.hpp"
#include "overlay.hpp"

namespace modar {

/// A window with an OpenGL ES 2.0 context.
class Window {
 public:
  /// Opens it and makes its context current on this thread.
  /// Errors: kUnsupported "window.unsupported" (no display, or a build without SDL2).
  static Result<std::unique_ptr<Window>> open(const std::string& title);
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  ~Window();

  /// Gives the window the shape of a picture, no larger than the display. Clicks are reported in
  /// that picture's pixels from now on.
  void fit(int width, int height);
  /// What the user did since the last call, waiting for at most `limit`. Valid until the next call.
  std::span<const UserAct> acts(std::chrono::milliseconds limit);
  [[nodiscard]] int width() const;  ///< of the framebuffer, pixels
  [[nodiscard]] int height() const;
  /// True once after the system took the context's contents away (a phone that slept, a driver that
  /// was reset).
  bool take_loss();
  /// Puts a new context in the place of the lost one and makes it current. Errors: kUnsupported
  /// "window.unsupported".
  Result<void> renew();
  /// Presents the drawing on the display.
  void swap();
  void set_title(const std::string& title);

 private:
  struct State;
  explicit Window(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Leaves out of `now` the rows at its top and bottom that are the same in `before`. The rows of
/// both have no padding.
void keep_changed_rows(const CameraPicture& before, CameraPicture& now);

class Screen {
 public:
  /// Opens the context that the options ask for on this thread, and uploads the bundle. Its bytes
  /// and the options outlive it.
  /// Errors: those of GlContext, Window, mask_gl_caps() and Renderer.
  static Result<std::unique_ptr<Screen>> open(const BundleView& bundle, const PlayOptions& options);
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Uploads another bundle in the place of the first, in the same context. Errors: those of
  /// Renderer; the first one stays then.
  Result<void> load(const BundleView& bundle);
  /// Sets the picture's size; nothing happens where it stands already. Where the window's context
  /// was lost, makes everything anew in another one first.
  Result<void> resize(int width, int height);
  /// Draws the background and the items as the camera sees them. before: the background of the draw
  /// before this one, whose pixels are still there, or one without a size: rows that are the same
  /// are not uploaded again.
  void draw(const CameraPicture& background, const Camera& camera, std::span<const DrawItem> items,
            const CameraPicture& before = {});
  /// The same over the painted canvas.
  void draw_on_canvas(const Camera& camera, std::span<const DrawItem> items);
  /// What a video's node shows from now on, instead of its poster. The pixels are copied.
  void show_video(std::uint32_t node, const RgbImage& image);
  /// False before the first picture, and after the context that had it is gone.
  [[nodiscard]] bool has_video(std::uint32_t node) const;
  /// Reads the picture back. The canvas of the same pixels may be painted on.
  RgbaView picture();
  Canvas canvas();

  /// Shows the drawing, or the painted canvas, in the window. Nothing without one.
  void present();
  void present_canvas();
  [[nodiscard]] bool has_window() const { return window_ != nullptr; }
  /// The window's title. Nothing without one.
  void set_title(const std::string& title);
  /// Nothing without a window.
  std::span<const UserAct> acts(std::chrono::milliseconds limit);

  [[nodiscard]] const RenderStats& stats() const { return stats_; }  ///< of the last draw()
  /// Bytes of frames and videos so far.
  [[nodiscard]] const UploadCounts& uploads() const { return uploads_; }
  [[nodiscard]] GpuMemory gpu_memory() const { return renderer_->gpu_memory(); }
  [[nodiscard]] const GlCaps& caps() const { return caps_; }

 private:
  Screen(const BundleView& bundle, const PlayOptions& options)
      : bundle_(bundle), options_(options) {}
  Result<void> read_caps();
  RgbImage canvas_picture();

  BundleView bundle_;
  const PlayOptions& options_;
  std::unique_ptr<GlContext> context_;
  std::unique_ptr<Window> window_;
  std::unique_ptr<Renderer> renderer_;  ///< goes before its context
  GlCaps caps_;
  RenderStats stats_;
  UploadCounts uploads_;
  bool painted_ = false;  ///< a canvas was uploaded since the last draw()
  std::vector<std::uint8_t> rgba_;
  std::vector<std::uint8_t> rgb_;  ///< of the canvas, on its way to the window
  /// Of a video's node.
  struct Video {
    std::uint32_t node = 0;
    unsigned texture = 0;
    CameraPicture picture;  ///< of pixels
    std::vector<std::uint8_t> pixels;
  };
  std::vector<Video> videos_;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace modar
