// A window with an OpenGL ES 2.0 context.
#pragma once

#include <memory>
#include <string>

#include "formats/error.hpp"

namespace modar {

class Window {
 public:
  /// Opens it and makes its context current on this thread.
  /// Errors: kUnsupported "window.unsupported" (no display, or a build without SDL2).
  static Result<std::unique_ptr<Window>> open(const std::string& title);
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  ~Window();

  /// Gives the window the shape of a picture, no larger than the display.
  void fit(int width, int height);
  /// Takes what the user did. Answers false once Escape, Q or the window's button ended it.
  bool poll();
  [[nodiscard]] int width() const;  ///< of the framebuffer, pixels
  [[nodiscard]] int height() const;
  /// Brings what was drawn to the display.
  void swap();

 private:
  struct State;
  explicit Window(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
