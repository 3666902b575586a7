// The window through SDL2 itself, with its driver that needs no display: keys and clicks come as a
// desktop sends them.
#include "runtime/play/screen.hpp"

#include <cstdlib>
#include <map>

#include <GLES2/gl2.h>
#include <SDL.h>
#include <gtest/gtest.h>

#include "formats/bundle_writer.hpp"
#include "modar/gl_context.hpp"
#include "runtime/play/frame_source.hpp"

namespace modar {
namespace {

using std::chrono::milliseconds;

void press(SDL_Keycode key) {
  SDL_Event event{};
  event.type = SDL_KEYDOWN;
  event.key.keysym.sym = key;
  SDL_PushEvent(&event);
}

void mouse(SDL_EventType type, int x, int y, int button) {
  SDL_Event event{};
  event.type = type;
  event.button.button = static_cast<std::uint8_t>(button);
  event.button.x = x;
  event.button.y = y;
  if (type == SDL_MOUSEMOTION) {
    event.motion = {};
    event.type = type;
    event.motion.state = static_cast<std::uint32_t>(SDL_BUTTON(button));
    event.motion.x = x;
    event.motion.y = y;
  }
  SDL_PushEvent(&event);
}

class WindowTest : public testing::Test {
 protected:
  /// SDL unloads the driver with its last window, and what Mesa keeps would have no name then for
  /// the leak checker to suppress: a display of our own keeps it loaded.
  static void SetUpTestSuite() { static_cast<void>(GlContext::create_offscreen()); }

  void SetUp() override {
    setenv("SDL_VIDEODRIVER", "offscreen", 1);
    auto opened = Window::open("test");
    if (!opened) GTEST_SKIP() << to_line(opened.error());
    window_ = std::move(*opened);
    static_cast<void>(window_->acts(milliseconds(0)));
  }
  void TearDown() override {
    window_.reset();
    unsetenv("SDL_VIDEODRIVER");
  }

  std::unique_ptr<Window> window_;
};

TEST_F(WindowTest, EachKeyIsItsAct) {
  const std::map<SDL_Keycode, Act> keys = {
      {SDLK_ESCAPE, Act::kQuit},        {SDLK_q, Act::kQuit},
      {SDLK_m, Act::kNextModel},        {SDLK_RIGHT, Act::kNextModel},
      {SDLK_LEFT, Act::kPreviousModel}, {SDLK_p, Act::kNextPattern},
      {SDLK_PLUS, Act::kLarger},        {SDLK_UP, Act::kLarger},
      {SDLK_MINUS, Act::kSmaller},      {SDLK_DOWN, Act::kSmaller},
      {SDLK_d, Act::kDisplay},          {SDLK_o, Act::kOutline},
      {SDLK_SPACE, Act::kPause},        {SDLK_f, Act::kFreeze}};
  for (const auto& [key, act] : keys) {
    press(SDLK_z);  // means nothing
    press(key);
    const auto acts = window_->acts(milliseconds(0));
    ASSERT_EQ(acts.size(), 1u) << SDL_GetKeyName(key);
    EXPECT_EQ(acts[0].act, act) << SDL_GetKeyName(key);
  }
}

TEST_F(WindowTest, ClosingIsQuitting) {
  SDL_Event event{};
  event.type = SDL_QUIT;
  SDL_PushEvent(&event);
  const auto acts = window_->acts(milliseconds(100));
  ASSERT_EQ(acts.size(), 1u);
  EXPECT_EQ(acts[0].act, Act::kQuit);
}

TEST_F(WindowTest, TheMouseIsInPixelsOfThePicture) {
  window_->fit(320, 240);
  const int width = window_->width();
  const int height = window_->height();
  ASSERT_GT(width, 0);
  for (const auto button : {SDL_BUTTON_LEFT, SDL_BUTTON_RIGHT}) {
    mouse(SDL_MOUSEBUTTONDOWN, width / 2, height / 2, button);
    mouse(SDL_MOUSEMOTION, width / 2, height / 2, button);
    mouse(SDL_MOUSEBUTTONUP, width / 2, height / 2, button);
  }
  const auto acts = window_->acts(milliseconds(0));
  ASSERT_EQ(acts.size(), 3u) << "the right button means nothing";
  const Act wanted[] = {Act::kDown, Act::kMove, Act::kUp};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(acts[i].act, wanted[i]);
    EXPECT_EQ(acts[i].size, glm::dvec2(320, 240));
    // The picture's middle is between its pixels 159 and 160, 119 and 120.
    EXPECT_NEAR(acts[i].at.x, 159.5, 1.0);
    EXPECT_NEAR(acts[i].at.y, 119.5, 1.0);
  }
}

TEST_F(WindowTest, ALostContextIsMadeAnewAndShowsTheSame) {
  window_.reset();
  BundleContent content;
  content.meta = "{}";
  const std::vector<std::byte> bytes = encode_bundle(content).value();
  const BundleView bundle = BundleView::open(bytes).value();
  PlayOptions options;
  options.window = true;
  auto screen = Screen::open(bundle, options);
  ASSERT_TRUE(screen) << to_line(screen.error());
  std::vector<std::uint8_t> rgb(3 * 16 * 12);
  for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<std::uint8_t>(i * 7);
  CameraPicture picture;
  picture.width = 16;
  picture.height = 12;
  picture.planes[0] = rgb.data();
  picture.strides[0] = 3 * 16;
  const auto drawn = [&] {
    EXPECT_TRUE((*screen)->resize(16, 12));
    (*screen)->draw(picture, default_camera(16, 12), {});
    const RgbaView seen = (*screen)->picture();
    return std::vector<std::uint8_t>(seen.pixels.begin(), seen.pixels.end());
  };
  const std::vector<std::uint8_t> before = drawn();
  ASSERT_EQ(before[4], rgb[3]);
  for (const std::uint32_t loss : {SDL_RENDER_DEVICE_RESET, SDL_APP_DIDENTERFOREGROUND}) {
    constexpr GLuint kMark = 4242;  // a name that only the context of before knows
    glBindBuffer(GL_ARRAY_BUFFER, kMark);
    ASSERT_TRUE(glIsBuffer(kMark));
    SDL_Event event{};
    event.type = loss;
    SDL_PushEvent(&event);
    EXPECT_TRUE((*screen)->acts(milliseconds(0)).empty());
    EXPECT_EQ(drawn(), before);
    EXPECT_FALSE(glIsBuffer(kMark));
  }
}

/// A film that stands still but for some rows, next to the same without the frame before.
TEST(ScreenTest, RowsThatAreTheSameAreNotUploadedAgain) {
  BundleContent content;
  content.meta = "{}";
  const std::vector<std::byte> bytes = encode_bundle(content).value();
  const BundleView bundle = BundleView::open(bytes).value();
  const PlayOptions options;
  auto screen = Screen::open(bundle, options);
  if (!screen) GTEST_SKIP() << to_line(screen.error());
  const auto frame = [](int changed) {
    Frame made;
    made.width = 16;
    made.height = 12;
    made.format = PictureFormat::kNv12;
    for (int i = 0; i < 16 * 18; ++i)
      made.yuv.push_back(static_cast<std::uint8_t>(40 + 7 * i % 150));
    for (int i = 0; i < 32; ++i) made.yuv[static_cast<std::size_t>(16 * changed + i)] ^= 0x1f;
    return made;
  };
  const auto shown = [&](const Frame& now, const Frame& before) {
    EXPECT_TRUE((*screen)->resize(16, 12));
    const UploadCounts so_far = (*screen)->uploads();
    (*screen)->draw(now.picture(), default_camera(16, 12), {}, before.picture());
    const UploadCounts after = (*screen)->uploads();
    EXPECT_EQ(after.bytes + after.same - so_far.bytes - so_far.same, 16u * 18);
    const RgbaView seen = (*screen)->picture();
    return std::pair(std::vector<std::uint8_t>(seen.pixels.begin(), seen.pixels.end()),
                     after.bytes - so_far.bytes);
  };
  const auto whole = shown(frame(4), {});
  EXPECT_EQ(whole.second, 16u * 18);
  EXPECT_EQ(shown(frame(8), frame(4)).second, 6u * 16 + 3u * 16) << "rows 4 to 9";
  const auto back = shown(frame(4), frame(8));
  EXPECT_EQ(back.second, 6u * 16 + 3u * 16);
  EXPECT_EQ(back.first, whole.first);
  EXPECT_EQ(shown(frame(4), frame(4)).second, 0u);
  // The last rows of chroma, which four rows of luma show.
  EXPECT_EQ(shown(frame(16), frame(4)).second, 8u * 16 + 4u * 16);
  // A canvas that is painted looks like a frame of colours.
  Frame colours;
  colours.width = 16;
  colours.height = 12;
  colours.rgb.assign(16 * 12 * 3, 90);
  const auto draw = [&] {
    (*screen)->draw(colours.picture(), default_camera(16, 12), {}, colours.picture());
    return (*screen)->uploads().bytes;
  };
  EXPECT_EQ(draw(), draw());
  (*screen)->draw_on_canvas(default_camera(16, 12), {});
  const std::uint64_t painted = (*screen)->uploads().bytes;
  EXPECT_EQ(draw() - painted, 16u * 12 * 3);
}

TEST_F(WindowTest, WaitsNoLongerThanItIsTold) {
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(window_->acts(milliseconds(30)).empty());
  const auto waited = std::chrono::steady_clock::now() - start;
  EXPECT_GE(waited, milliseconds(25));
}

}  // namespace
}  // namespace modar
