// A window with an OpenGL ES 2.0 context, and what the user does in it.
#pragma once

#include <chrono>
#include <memory>
#include <span>
#include <string>

#include "controls.hpp"
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

  /// Gives the window the shape of a picture, no larger than the display. Clicks are told in that
  /// picture's pixels from now on.
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
  /// Brings what was drawn to the display.
  void swap();

 private:
  struct State;
  explicit Window(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace modar
