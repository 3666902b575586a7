// A window through SDL2 with an OpenGL ES 2.0 context.
#include <algorithm>

#include <SDL.h>

#include "window.hpp"

namespace modar {

struct Window::State {
  SDL_Window* window = nullptr;
  SDL_GLContext context = nullptr;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (context != nullptr) SDL_GL_DeleteContext(context);
    if (window != nullptr) SDL_DestroyWindow(window);
    SDL_QuitSubSystem(SDL_INIT_VIDEO);
  }
};

namespace {

tl::unexpected<Error> no_window() {
  return fail(ExitCode::kUnsupported, "window.unsupported", "--window",
              std::string("no window can be opened: ") + SDL_GetError(),
              "start it on a desktop, or leave out --window and use --out");
}

}  // namespace

Window::Window(std::unique_ptr<State> state) : state_(std::move(state)) {}
Window::~Window() = default;

Result<std::unique_ptr<Window>> Window::open(const std::string& title) {
  // The user's Ctrl-C stays ours.
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_OPENGL_ES_DRIVER, "1");
  if (SDL_InitSubSystem(SDL_INIT_VIDEO) != 0) return no_window();
  auto state = std::make_unique<State>();
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_ES);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 2);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 0);
  SDL_GL_SetAttribute(SDL_GL_DOUBLEBUFFER, 1);
  state->window = SDL_CreateWindow(title.c_str(), SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED,
                                   960, 540, SDL_WINDOW_OPENGL | SDL_WINDOW_RESIZABLE);
  if (state->window == nullptr) return no_window();
  state->context = SDL_GL_CreateContext(state->window);
  if (state->context == nullptr) return no_window();
  SDL_GL_SetSwapInterval(1);
  return std::unique_ptr<Window>(new Window(std::move(state)));
}

void Window::fit(int width, int height) {
  SDL_Rect usable{0, 0, width, height};
  SDL_GetDisplayUsableBounds(std::max(0, SDL_GetWindowDisplayIndex(state_->window)), &usable);
  const double shrink = std::min(
      {1.0, static_cast<double>(usable.w) / width, static_cast<double>(usable.h) / height});
  SDL_SetWindowSize(state_->window, std::max(1, static_cast<int>(width * shrink)),
                    std::max(1, static_cast<int>(height * shrink)));
}

bool Window::poll() {
  SDL_Event event;
  while (SDL_PollEvent(&event) != 0) {
    if (event.type == SDL_QUIT) return false;
    if (event.type != SDL_KEYDOWN) continue;
    const SDL_Keycode key = event.key.keysym.sym;
    if (key == SDLK_ESCAPE || key == SDLK_q) return false;
  }
  return true;
}

int Window::width() const {
  int width = 0;
  SDL_GL_GetDrawableSize(state_->window, &width, nullptr);
  return width;
}

int Window::height() const {
  int height = 0;
  SDL_GL_GetDrawableSize(state_->window, nullptr, &height);
  return height;
}

void Window::swap() {
  SDL_GL_SwapWindow(state_->window);
}

}  // namespace modar
