// A window through SDL2 with an OpenGL ES 2.0 context; letters by OpenCV, which throws: caught
// here.
#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include <SDL.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "overlay.hpp"
#include "screen.hpp"

namespace modar {

struct Window::State {
  SDL_Window* window = nullptr;
  SDL_GLContext context = nullptr;
  std::vector<UserAct> acts;
  glm::dvec2 picture{1.0};  ///< its size
  bool lost = false;

  void touch(Act act, int x, int y);

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

struct KeyAct {
  SDL_Keycode key;
  Act act;
};
constexpr KeyAct kKeys[] = {
    {SDLK_ESCAPE, Act::kQuit},        {SDLK_q, Act::kQuit},
    {SDLK_m, Act::kNextModel},        {SDLK_RIGHT, Act::kNextModel},
    {SDLK_LEFT, Act::kPreviousModel}, {SDLK_p, Act::kNextPattern},
    {SDLK_PLUS, Act::kLarger},        {SDLK_EQUALS, Act::kLarger},
    {SDLK_UP, Act::kLarger},          {SDLK_MINUS, Act::kSmaller},
    {SDLK_DOWN, Act::kSmaller},       {SDLK_d, Act::kDisplay},
    {SDLK_o, Act::kOutline},          {SDLK_SPACE, Act::kPause},
    {SDLK_f, Act::kFreeze},           {SDLK_s, Act::kSound},
    {SDLK_c, Act::kCaptions},         {SDLK_9, Act::kQuieter},
    {SDLK_0, Act::kLouder},
};

/// Nothing: the key has no meaning.
const KeyAct* act_of(SDL_Keycode key) {
  const auto* found = std::ranges::find(kKeys, key, &KeyAct::key);
  return found == std::end(kKeys) ? nullptr : found;
}

}  // namespace

/// From window coordinates to pixels of the picture, which is centred in the window as large as it
/// fits (Renderer::blit_to_window()).
void Window::State::touch(Act act, int x, int y) {
  int width = 1;
  int height = 1;
  SDL_GetWindowSize(window, &width, &height);
  const double scale = std::min(width / picture.x, height / picture.y);
  acts.push_back({act,
                  {(x + 0.5 - width / 2.0) / scale + picture.x / 2.0 - 0.5,
                   (y + 0.5 - height / 2.0) / scale + picture.y / 2.0 - 0.5},
                  picture});
}

Window::Window(std::unique_ptr<State> state) : state_(std::move(state)) {}
Window::~Window() = default;

Result<std::unique_ptr<Window>> Window::open(const std::string& title) {
  // The user's Ctrl-C stays ours.
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_OPENGL_ES_DRIVER, "1");
  if (SDL_InitSubSystem(SDL_INIT_VIDEO) != 0) return no_window();
  // Without a display SDL may draw where nobody sees it; who wants that says so in SDL_VIDEODRIVER.
  const std::string_view driver = SDL_GetCurrentVideoDriver();
  if (std::getenv("SDL_VIDEODRIVER") == nullptr && (driver == "offscreen" || driver == "dummy")) {
    SDL_SetError("there is no display");
    return no_window();
  }
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
  state_->picture = {width, height};
  SDL_Rect usable{0, 0, width, height};
  SDL_GetDisplayUsableBounds(std::max(0, SDL_GetWindowDisplayIndex(state_->window)), &usable);
  const double shrink = std::min(
      {1.0, static_cast<double>(usable.w) / width, static_cast<double>(usable.h) / height});
  SDL_SetWindowSize(state_->window, std::max(1, static_cast<int>(width * shrink)),
                    std::max(1, static_cast<int>(height * shrink)));
}

std::span<const UserAct> Window::acts(std::chrono::milliseconds limit) {
  state_->acts.clear();
  SDL_Event event;
  int more = limit.count() > 0 ? SDL_WaitEventTimeout(&event, static_cast<int>(limit.count()))
                               : SDL_PollEvent(&event);
  for (; more != 0; more = SDL_PollEvent(&event)) {
    const bool button = event.button.button == SDL_BUTTON_LEFT;
    if (event.type == SDL_RENDER_DEVICE_RESET || event.type == SDL_APP_DIDENTERFOREGROUND) {
      state_->lost = true;
    } else if (event.type == SDL_QUIT) {
      state_->acts.push_back({});
    } else if (event.type == SDL_KEYDOWN) {
      if (const KeyAct* key = act_of(event.key.keysym.sym)) state_->acts.push_back({key->act});
    } else if (event.type == SDL_MOUSEBUTTONDOWN && button) {
      state_->touch(Act::kDown, event.button.x, event.button.y);
    } else if (event.type == SDL_MOUSEBUTTONUP && button) {
      state_->touch(Act::kUp, event.button.x, event.button.y);
    } else if (event.type == SDL_MOUSEMOTION && (event.motion.state & SDL_BUTTON_LMASK) != 0) {
      state_->touch(Act::kMove, event.motion.x, event.motion.y);
    }
  }
  return state_->acts;
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

bool Window::take_loss() {
  return std::exchange(state_->lost, false);
}

Result<void> Window::renew() {
  SDL_GL_DeleteContext(state_->context);
  state_->context = SDL_GL_CreateContext(state_->window);
  if (state_->context == nullptr) return no_window();
  SDL_GL_SetSwapInterval(1);
  return {};
}

void Window::set_title(const std::string& title) {
  SDL_SetWindowTitle(state_->window, title.c_str());
}

void Window::swap() {
  SDL_GL_SwapWindow(state_->window);
}

Result<void> draw_text_bar(const Canvas& canvas, const std::string& text) {
  try {
    cv::Mat picture(canvas.height, canvas.width, CV_8UC4, canvas.rgba.data());
    const double scale = std::max(0.4, canvas.width / 1600.0);
    const int height = std::min(canvas.height, cvRound(44 * scale));
    cv::Mat bar = picture(cv::Rect(0, 0, canvas.width, height));
    bar *= 0.35;
    bar |= cv::Scalar(0, 0, 0, 255);
    cv::putText(picture, text, cv::Point(cvRound(10 * scale), height - cvRound(13 * scale)),
                cv::FONT_HERSHEY_SIMPLEX, scale, cv::Scalar(255, 255, 255, 255),
                std::max(1, cvRound(1.6 * scale)), cv::LINE_AA);
  } catch (const std::exception& error) {
    return fail(ExitCode::kInternal, "display.opencv", "", std::string("OpenCV: ") + error.what(),
                "leave out --osd");
  }
  return {};
}

}  // namespace modar
