// Every float and double that modar.h takes, with values that no camera and no clock has. Under
// UBSan, a conversion that overflows ends the test.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>
#include <vector>

#include "modar/modar.h"
#include "tests/formats/support.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

constexpr int kSide = 64;
constexpr double kUnusable[] = {NAN,    INFINITY, -INFINITY, 1e300, -1e300,
                                1.1e12, -1.1e12,  3e38,      -1e19};
constexpr double kUsable[] = {0.0, 5e-324, -5e-324, 1e-310, 1e-40, -1e-40, 1e-9,
                              1.0, 1e5,    -1e5,    1e9,    -1e9,  1e12,   -1e12};

/// Calls the functions of modar.h on a bundle with nodes, with one number in the place of each of
/// theirs in turn.
class CapiNumbers : public ::testing::Test {
 protected:
  using Call = std::function<void()>;

  void SetUp() override {
    bytes_ = test::encode(test::acting_content());
    bundle_ = modar_bundle_open_bytes(bytes_.data(), bytes_.size(), nullptr);
    ASSERT_NE(bundle_, nullptr);
    context_ = modar_context_create(nullptr);
    renderer_ = modar_renderer_create(bundle_, nullptr, 0, nullptr);
    ASSERT_NE(renderer_, nullptr);
    ASSERT_EQ(modar_renderer_resize(renderer_, kSide, kSide, nullptr), 0);
    screen_ = modar_screen_create(bundle_, nullptr);
    modar_scene_at(bundle_, 0, &scene_);
    modar_camera_default(kSide, kSide, &camera_);
    modar_render_options_default(&options_);
    picture_.format = MODAR_RGBA;
    picture_.width = picture_.height = kSide;
    picture_.planes[0] = pixels_.data();
    picture_.strides[0] = 4 * kSide;
    std::copy_n(view_, 16, item_.to_eye);
    pose_.rotation[0] = pose_.rotation[4] = pose_.rotation[8] = 1;
    pose_.translation[2] = 4;
  }
  void TearDown() override {
    modar_screen_destroy(screen_);
    modar_renderer_destroy(renderer_);
    modar_context_destroy(context_);
    modar_bundle_close(bundle_);
  }

  /// The call with the number in each place of an array, of which others keep theirs.
  template <class Number>
  void each(Number* numbers, std::size_t count, const Call& call) {
    for (std::size_t i = 0; i < count; ++i) {
      const Number before = std::exchange(numbers[i], static_cast<Number>(number_));
      call();
      numbers[i] = before;
    }
  }
  void draw() {
    modar_drawing drawing = drawing_;
    modar_renderer_render(renderer_, &picture_, &drawing);
    modar_renderer_observe(renderer_, &picture_, &drawing);
    drawing.projection = view_;
    modar_renderer_draw(renderer_, &surface_, &picture_, &drawing);
    modar_projection(&camera_, 0.1, 10, out_);
    auto hit = sized<modar_hit>();
    modar_pick(bundle_, &drawing, 32, 32, &hit);
    auto label = sized<modar_label>();
    modar_label_project(screen_, 2, &drawing, view_, &label);
    modar_item items[8] = {sized<modar_item>()};
    modar_screen_items(screen_, 0, view_, items, std::size(items));
    modar_tracker_destroy(modar_tracker_create(bundle_, &camera_, nullptr, nullptr));
  }
  void draw_arrays();
  int count_answers();
  int track();

  double number_ = 0;
  std::vector<std::byte> bytes_;
  modar_bundle* bundle_ = nullptr;
  modar_context* context_ = nullptr;
  modar_renderer* renderer_ = nullptr;
  modar_screen* screen_ = nullptr;
  modar_scene scene_ = sized<modar_scene>();
  modar_camera camera_ = sized<modar_camera>();
  modar_picture picture_ = sized<modar_picture>();
  modar_item item_ = sized<modar_item>();
  modar_drawing drawing_{sizeof(modar_drawing), &camera_, nullptr, &item_, 1};
  modar_pose pose_ = sized<modar_pose>();
  modar_render_options options_ = sized<modar_render_options>();
  modar_surface surface_{sizeof(modar_surface), 0, 0, kSide, kSide, 90, 0, 1, 0};
  float view_[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -4, 1};
  float out_[16] = {};
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(4 * kSide * kSide, 90);
};

void CapiNumbers::draw_arrays() {
  const Call drawing = [this] { draw(); };
  for (double* lens : {&camera_.fx, &camera_.fy, &camera_.cx, &camera_.cy}) each(lens, 1, drawing);
  each(camera_.distortion, 5, drawing);
  each(item_.to_eye, 16, drawing);
  each(item_.world_to_eye, 16, drawing);
  each(&item_.opacity, 1, drawing);
  each(view_, 16, drawing);
  const Call placing = [this] {
    modar_item placed = item_;
    modar_item_place(&placed, &scene_, &pose_);
    modar_drawing placed_drawing = drawing_;
    placed_drawing.items = &placed;
    modar_renderer_render(renderer_, &picture_, &placed_drawing);
  };
  each(pose_.rotation, 9, placing);
  each(pose_.translation, 3, placing);
  each(pose_.stretch, 12, placing);
  each(scene_.place, 16, placing);
  const Call lighting = [this] {
    modar_renderer_set_options(renderer_, &options_);
    modar_renderer_render(renderer_, &picture_, &drawing_);
  };
  each(options_.light, 3, lighting);
  each(&options_.light_strength, 1, lighting);
  each(&options_.ambient_strength, 1, lighting);
  each(options_.clear_colour, 4, lighting);
  each(&options_.lod_pixels, 1, lighting);
}

/// 1 if a tracker can be created and takes the number as its time.
int CapiNumbers::track() {
  modar_tracker_options how = {sizeof how, 0, 0, number_, 0, 0, 0, 0};
  modar_tracker_destroy(modar_tracker_create(bundle_, &camera_, &how, nullptr));
  how.smooth_ms = 0;
  modar_tracker* tracker = modar_tracker_create(bundle_, &camera_, &how, nullptr);
  if (tracker == nullptr) return 0;
  const double turn[] = {0, number_, 0};
  modar_tracker_turn(tracker, turn);
  const int status = modar_tracker_step(tracker, pixels_.data(), kSide, number_, nullptr);
  modar_tracker_step(tracker, pixels_.data(), kSide, -1, nullptr);
  modar_tracker_destroy(tracker);
  return status == 0 ? 1 : 0;
}

/// How many of the functions that take single numbers answer.
int CapiNumbers::count_answers() {
  char text[64];
  auto camera = camera_;
  auto pose = pose_;
  auto hit = sized<modar_hit>();
  double x = -7;
  modar_surface_to_frame(&surface_, &camera_, number_, number_, &x, nullptr);
  std::fill(std::begin(out_), std::end(out_), -7.0f);
  modar_projection(&camera_, number_, number_, out_);
  std::vector<std::uint8_t> flat(MODAR_FLAT_SIDE * MODAR_FLAT_SIDE);
  int wide = 0;
  int high = 0;
  float corners[] = {2, 2, 60, 2, 60, 60, 2, 60};
  int flats = 0;
  each(corners, 8,
       [&] { flats += modar_photo_flat(&picture_, corners, flat.data(), &wide, &high); });
  modar_turntable from{sizeof from, 0, 0, 1};
  int orbits = 0;
  for (double* place : {&from.turn, &from.tilt, &from.zoom})
    each(place, 1, [&] { orbits += modar_orbit(bundle_, 0, &from, &camera, &pose); });
  modar_touch touch{sizeof touch, MODAR_TOUCH_DOWN, 1, 9, 9, 64, 64};
  modar_screen_touch(screen_, &touch);
  touch.kind = MODAR_TOUCH_MOVE;
  touch.x = touch.y = 50;
  int moves = 0;
  for (double* place : {&touch.x, &touch.y, &touch.width, &touch.height})
    each(place, 1, [&] { moves += modar_screen_touch(screen_, &touch); });
  for (const int button : {MODAR_TURN, MODAR_TILT, MODAR_SIZE})
    modar_screen_press(screen_, button, number_);
  modar_screen_look_around(screen_, 0, number_, 1);
  modar_screen_follow(screen_, number_, 1, 0, 100);
  modar_screen_follow(screen_, 0, 1, 0, number_);
  auto status = sized<modar_status>();
  modar_screen_status(screen_, &status);
  moves += status.state;
  moves += modar_screen_turntable(screen_, number_, &from);
  modar_screen_turntable(screen_, 0, &from);
  moves += from.turn != 0 || from.zoom != 1 || modar_screen_waiting(screen_) != 0 ? 1 : 0;
  const bool words = modar_node_caption(bundle_, 4, "en", number_, text, sizeof text) != 0;
  return flats + track() + moves + (words ? 1 : 0) + (x != -7 ? 1 : 0) + (out_[0] != -7 ? 1 : 0) +
         orbits + static_cast<int>(modar_screen_step(screen_, number_, nullptr, 0)) +
         modar_pick(bundle_, &drawing_, number_, 3, &hit) +
         modar_pick(bundle_, &drawing_, 3, number_, &hit);
}

TEST_F(CapiNumbers, UnusableOnesGiveEmptyAnswers) {
  for (const double number : kUnusable) {
    number_ = number;
    EXPECT_EQ(count_answers(), 0) << number;
    draw_arrays();
  }
  auto error = sized<modar_error>();
  const modar_tracker_options how = {sizeof how, 0, 0, NAN, 0, 0, 0, 0};
  EXPECT_EQ(modar_tracker_create(bundle_, &camera_, &how, &error), nullptr);
  EXPECT_STREQ(error.code, "capi.number");
}

TEST_F(CapiNumbers, TinyAndLargeOnesAreCalculatedWith) {
  for (const double number : kUsable) {
    number_ = number;
    EXPECT_GT(count_answers(), 2) << number;
    draw_arrays();
  }
}

}  // namespace
}  // namespace modar
