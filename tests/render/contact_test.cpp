// What ties a model to its place: baked occlusion, the shadow on the pattern's plane, and real
// things that hide it.
#include <cmath>
#include <cstring>

#include <glm/gtc/matrix_transform.hpp>

#include "formats/colour_grid.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

constexpr int kSide = 32;

class ContactTest : public GlTest {};

/// A square in z = 0 that faces +z.
std::vector<Triangle> square(double half, const Rgb& colour) {
  std::vector<Triangle> triangles(2);
  triangles[0].corners = {glm::dvec3(-half, -half, 0), {half, -half, 0}, {half, half, 0}};
  triangles[1].corners = {glm::dvec3(-half, -half, 0), {half, half, 0}, {-half, half, 0}};
  for (Triangle& triangle : triangles) triangle.colour = colour;
  return triangles;
}

/// Looks down onto the plane z = 0, of which the picture shows 2 x 2 units.
glm::mat4 from_above() {
  return glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, -4.0f));
}

int red(const std::vector<std::uint8_t>& pixels, int x, int y) {
  return pixels[static_cast<std::size_t>(4 * (y * kSide + x))];
}

void add_pattern_and_scene(BundleContent& content) {
  add_square_pattern(content);
  SceneRecord scene{};
  scene.scale = 1.0f;
  scene.rotation[3] = 1.0f;
  content.scenes.push_back(scene);
}

TEST_F(ContactTest, OcclusionDimsTheLightFromAllAround) {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfLit, square(1.0, {200, 200, 200}));
  // Behind the three bytes of the normal: 0 and 127 represent nothing and all; ES 2 reads 63 as
  // 127 / 255.
  const std::vector<std::pair<int, double>> stored = {
      {127, 1.0}, {63, 127.0 / 255}, {31, 63.0 / 255}};
  for (const auto& [byte, share] : stored) {
    BundleContent content = maker.content;
    content.occlusion.push_back({0, 11});
    for (std::size_t v = 0; v < 6; ++v) {
      content.vertices[v * 16 + 11] = static_cast<std::byte>(byte);
    }
    const MappedBundle bundle(content);
    for (const bool halves : {true, false}) {
      GlCaps caps = probe_gl_caps();
      caps.half_float_vertices = caps.half_float_vertices && halves;
      const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, caps);
      ASSERT_TRUE(renderer);
      RenderOptions options;
      options.light = RoomLight{};
      options.light->sky[0] = glm::vec3(0.8f);
      renderer->set_options(options);
      const DrawItem item{0, from_above()};
      const auto pixels = draw(*renderer, camera_above(kSide), {&item, 1});
      // ES 3 reads 63 as 63 / 127: the middle of both, within both.
      const double light = 0.8 * share;
      EXPECT_NEAR(red(pixels, 16, 16), 200 * (1.05 * std::sqrt(light) - 0.05 * light), 2)
          << byte << halves;
    }
  }
}

std::vector<std::byte> shadow_section(const ShadowHeader& header,
                                      const std::vector<std::uint8_t>& texels) {
  std::vector<std::byte> section(sizeof header + texels.size());
  std::memcpy(section.data(), &header, sizeof header);
  std::memcpy(section.data() + sizeof header, texels.data(), texels.size());
  return section;
}

TEST_F(ContactTest, AShadowDarkensThePictureInItsRectangle) {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, square(0.125, {10, 20, 30}));
  add_pattern_and_scene(maker.content);
  // Left half: a quarter of the light is left; right half: all.
  maker.content.shadows.push_back(
      shadow_section({2, 1, {-0.5f, -0.5f}, {0.5f, 0.5f}, {}}, {64, 255}));
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const std::vector<std::uint8_t> white(3 * kSide * kSide, 200);
  const RgbImage background{white.data(), kSide, kSide, 3 * kSide};
  const DrawItem item{0, from_above(), 0, from_above()};
  const auto pixels = draw(*renderer, camera_above(kSide), {&item, 1}, background);
  // 2 units are 32 pixels: the rectangle spans columns and rows 8 to 24.
  EXPECT_EQ(red(pixels, 4, 16), 200);
  EXPECT_NEAR(red(pixels, 9, 9), 200 * std::sqrt(64.0 / 255), 2);
  EXPECT_NEAR(red(pixels, 23, 22), 200, 2);
  EXPECT_EQ(red(pixels, 16, 16), 10) << "the model is on its shadow";
  // An item of no scene has none.
  const DrawItem alone{0, from_above()};
  EXPECT_EQ(red(draw(*renderer, camera_above(kSide), {&alone, 1}, background), 9, 9), 200);
}

TEST_F(ContactTest, AShadowGoesWithItsModelAndStaysInThePlane) {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, square(0.0625, {10, 20, 30}));
  add_pattern_and_scene(maker.content);
  maker.content.shadows.push_back(
      shadow_section({1, 1, {-0.25f, -0.25f}, {0.25f, 0.25f}, {}}, {64}));
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const std::vector<std::uint8_t> white(3 * kSide * kSide, 200);
  const RgbImage background{white.data(), kSide, kSide, 3 * kSide};
  // Half a unit, 8 pixels, to the right, twice as large, and lifted off the plane.
  glm::mat4 moved = glm::translate(from_above(), glm::vec3(0.5f, 0.0f, 1.0f));
  moved = glm::scale(moved, glm::vec3(2.0f));
  const DrawItem item{0, moved, 0, from_above()};
  const auto pixels = draw(*renderer, camera_above(kSide), {&item, 1}, background);
  // From column 16 to 32, from row 8 to 24: as large as at no height.
  const int dark = static_cast<int>(std::lround(200 * std::sqrt(64.0 / 255)));
  EXPECT_EQ(red(pixels, 14, 16), 200);
  EXPECT_NEAR(red(pixels, 17, 16), dark, 2);
  EXPECT_NEAR(red(pixels, 30, 10), dark, 2);
  EXPECT_NEAR(red(pixels, 20, 22), dark, 2);
  EXPECT_EQ(red(pixels, 20, 25), 200);
}

/// Mean colours of a gray pattern whose every cell is 1/2.
void add_gray_colours(BundleContent& content) {
  const ColourGridHeader grid{8, 8, {}};
  ExtraSection colours;
  colours.type = static_cast<std::uint32_t>(SectionType::kPatternColours);
  colours.owner = 0;
  colours.bytes.resize(sizeof grid);
  std::memcpy(colours.bytes.data(), &grid, sizeof grid);
  for (int i = 0; i < 8 * 8 * 3; ++i) {
    colours.bytes.push_back(std::byte{0x00});
    colours.bytes.push_back(std::byte{0x80});
  }
  content.extra.push_back(colours);
}

TEST_F(ContactTest, LightFollowsWhatTheCameraShowsOfThePattern) {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfLit, square(0.5, {200, 200, 200}));
  add_pattern_and_scene(maker.content);
  add_gray_colours(maker.content);
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  RenderOptions options;
  options.light = RoomLight{};
  options.light->sky[0] = glm::vec3(0.8f);
  const DrawItem item{0, from_above(), 0, from_above()};
  // A half of 0.36, in sRGB: IEC 61966-2-1.
  const double seen = 1.055 * std::pow(0.5 * 0.36, 1 / 2.4) - 0.055;
  const std::vector<std::uint8_t> dim(3 * kSide * kSide,
                                      static_cast<std::uint8_t>(std::lround(255 * seen)));
  const RgbImage background{dim.data(), kSide, kSide, 3 * kSide};
  const auto shade = [](double light) { return 200 * (1.05 * std::sqrt(light) - 0.05 * light); };
  options.estimate_light = false;
  renderer->set_options(options);
  EXPECT_NEAR(red(draw(*renderer, camera_above(kSide), {&item, 1}, background), 16, 16), shade(0.8),
              2);
  options.estimate_light = true;
  renderer->set_options(options);
  EXPECT_NEAR(red(draw(*renderer, camera_above(kSide), {&item, 1}, background), 16, 16),
              shade(0.36), 4);
  // Without a picture, the last one counts.
  EXPECT_NEAR(red(draw(*renderer, camera_above(kSide), {&item, 1}), 16, 16), shade(0.36), 4);
  // An app that draws the picture itself shows a copy of a quarter of its size.
  const std::unique_ptr<Renderer> other = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(other);
  other->set_options(options);
  CameraPicture copy;
  copy.width = copy.height = kSide / 4;
  copy.planes[0] = dim.data();
  copy.strides[0] = 3 * copy.width;
  EXPECT_NEAR(red(draw(*other, camera_above(kSide), {&item, 1}), 16, 16), shade(0.8), 2);
  other->observe(copy, gl_projection(camera_above(kSide), 0.1, 100.0), {&item, 1});
  EXPECT_NEAR(red(draw(*other, camera_above(kSide), {&item, 1}), 16, 16), shade(0.36), 4);
  // Light that changes is followed within a second.
  const std::vector<std::uint8_t> bright(3 * kSide * kSide, 188);  // sRGB of 1/2
  const RgbImage lit{bright.data(), kSide, kSide, 3 * kSide};
  draw(*renderer, camera_above(kSide), {&item, 1}, lit);
  for (int frame = 0; frame < 40; ++frame) draw(*renderer, camera_above(kSide), {&item, 1}, lit);
  EXPECT_NEAR(red(draw(*renderer, camera_above(kSide), {&item, 1}, lit), 16, 16), shade(1.0), 4);
}

TEST_F(ContactTest, AnOccluderShowsThePictureAndHidesTheModel) {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, square(0.75, {10, 20, 30}));
  maker.add_plain_model(Layout::kHalfColoured, square(0.25, {250, 0, 0}));
  maker.content.materials[1].flags |= kMaterialOccluder;
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const std::vector<std::uint8_t> gray(3 * kSide * kSide, 120);
  const RgbImage background{gray.data(), kSide, kSide, 3 * kSide};
  const glm::mat4 nearer = glm::translate(from_above(), glm::vec3(0.0f, 0.0f, 0.5f));
  const std::vector<DrawItem> items = {{0, from_above()}, {1, nearer}};
  for (int frame = 0; frame < 2; ++frame) {  // the masks of the first are not left behind
    const auto pixels = draw(*renderer, camera_above(kSide), items, background);
    EXPECT_EQ(red(pixels, 16, 16), 120);
    EXPECT_EQ(red(pixels, 7, 16), 10);
    EXPECT_EQ(red(pixels, 1, 16), 120);
  }
}

TEST_F(ContactTest, ThePlaneHidesWhatLiesUnderIt) {
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, square(0.5, {10, 20, 30}));
  add_pattern_and_scene(maker.content);
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  RenderOptions options = flat_light();
  for (const bool hides : {false, true}) {
    options.plane_hides = hides;
    renderer->set_options(options);
    for (const float height : {-0.3f, 0.3f}) {
      const DrawItem item{0, glm::translate(from_above(), glm::vec3(0.0f, 0.0f, height)), 0,
                          from_above()};
      const auto pixels = draw(*renderer, camera_above(kSide), {&item, 1});
      EXPECT_EQ(red(pixels, 16, 16), hides && height < 0 ? 0 : 10) << hides << height;
    }
  }
}

TEST_F(ContactTest, GlassHidesNothingThatIsDrawnAfterIt) {
  // Two panes of one chunk, the nearer one first: the farther one still shows through.
  std::vector<Triangle> panes = square(0.75, {200, 0, 0});
  for (Triangle& triangle : panes) {
    for (glm::dvec3& corner : triangle.corners) corner.z = 0.5;
  }
  const std::vector<Triangle> farther = square(0.75, {0, 200, 0});
  panes.insert(panes.end(), farther.begin(), farther.end());
  SceneMaker maker;
  maker.add_plain_model(Layout::kHalfColoured, panes);
  maker.content.materials[0].opacity = 0.5f;
  const MappedBundle bundle(maker.content);
  const std::unique_ptr<Renderer> renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_TRUE(renderer);
  const DrawItem item{0, from_above()};
  const auto pixels = draw(*renderer, camera_above(kSide), {&item, 1});
  EXPECT_NEAR(pixels[4 * (16 * kSide + 16) + 1], 100, 2);
}

}  // namespace
}  // namespace modar
