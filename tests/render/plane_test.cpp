// Pictures that are on a pattern: their texels unchanged, hidden and hiding.
#include <GLES2/gl2.h>
#include <glm/gtc/matrix_transform.hpp>

#include "modar/screen_machine.hpp"
#include "tests/render/scene.hpp"

namespace modar {
namespace {

constexpr int kPlaneSide = 32;

class PlaneTest : public GlTest {};

/// All pixels of one gray: 4 bits of colour in both halves, and the least modifier.
std::vector<std::byte> plain_block(int red, int green, int blue) {
  const auto channel = [](int value) { return static_cast<std::byte>(value << 4 | value); };
  return {channel(red), channel(green), channel(blue), std::byte{0},
          std::byte{0}, std::byte{0},   std::byte{0},  std::byte{0}};
}

/// Two rows of four blocks would do; a texture of 4 x 4 is one block, of one colour.
std::uint32_t add_flat(SceneMaker& maker, int red, int green, int blue, int alpha) {
  std::vector<std::vector<std::byte>> twin;
  if (alpha >= 0) twin = {plain_block(alpha, alpha, alpha)};
  return maker.add_texture(4, {plain_block(red, green, blue)}, twin,
                           alpha >= 0 ? std::uint32_t{kTextureAlpha} : 0u);
}

void add_picture(BundleContent& content, const char* name, std::uint32_t texture) {
  NodeRecord node{};
  node.name = content.intern(name);
  node.kind = static_cast<std::uint32_t>(NodeKind::kPicture);
  node.subject = texture;
  node.rotation[3] = 1.0f;
  node.half_size[0] = node.half_size[1] = 0.5f;
  content.nodes.push_back(node);
}

glm::mat4 over_plane(float z) {
  return glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, z - 4.0f));
}

DrawItem picture_at(std::uint32_t node, const glm::mat4& to_eye) {
  DrawItem item{kNone, to_eye};
  item.node = node;
  return item;
}

Rgb texel_at(const std::vector<std::uint8_t>& pixels, int x, int y) {
  const auto i = static_cast<std::size_t>(4 * (y * kPlaneSide + x));
  return {pixels[i], pixels[i + 1], pixels[i + 2]};
}

TEST_F(PlaneTest, ShowsItsTexelsWhereItStands) {
  SceneMaker maker;
  add_square_pattern(maker.content);
  add_picture(maker.content, "solid", add_flat(maker, 12, 5, 2, -1));
  add_picture(maker.content, "glass", add_flat(maker, 3, 9, 14, 8));
  NodeRecord& solid = maker.content.nodes[0];
  solid.half_size[1] = 0.25f;
  solid.place[1] = 0.5f;
  const MappedBundle bundle(maker.content);
  auto renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_NE(renderer, nullptr);
  std::vector<DrawItem> items;
  ScreenMachine(*bundle.view).add_items(0, over_plane(0), items);
  ASSERT_EQ(items.size(), 2u);
  const auto pixels = draw(*renderer, camera_above(kPlaneSide), items);
  // By the tables of ETC1: 17 times the four bits, and 2 or 8 of its modifiers.
  const Rgb opaque = texel_at(pixels, 16, 6);
  EXPECT_NEAR(opaque[0], 12 * 17 + 2, 1);
  EXPECT_NEAR(opaque[1], 5 * 17 + 2, 1);
  EXPECT_NEAR(opaque[2], 2 * 17 + 2, 1);
  // The solid one covers y from 0.25 to 0.75, the glass -0.5 to 0.5: rows 4 to 11 and 8 to 23.
  EXPECT_EQ(texel_at(pixels, 16, 3), (Rgb{0, 0, 0}));
  EXPECT_EQ(texel_at(pixels, 16, 4), opaque);
  const double alpha = (8 * 17 + 2) / 255.0;
  const Rgb both = texel_at(pixels, 16, 9);
  const Rgb glass = texel_at(pixels, 16, 20);
  const int colour[] = {3, 9, 14};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(glass[c], alpha * (colour[c] * 17 + 2), 1.5) << c;
    EXPECT_NEAR(both[c], glass[c] + (1 - alpha) * opaque[c], 2) << c;
  }
  EXPECT_EQ(texel_at(pixels, 16, 24), (Rgb{0, 0, 0}));
  EXPECT_EQ(texel_at(pixels, 7, 16), (Rgb{0, 0, 0}));
  EXPECT_EQ(renderer->stats().draw_calls, 2);
}

void add_green_square(SceneMaker& maker) {
  std::vector<Triangle> square(2);
  square[0].corners = {glm::dvec3(-0.25, -0.25, 0), {0.25, -0.25, 0}, {0.25, 0.25, 0}};
  square[1].corners = {glm::dvec3(-0.25, -0.25, 0), {0.25, 0.25, 0}, {-0.25, 0.25, 0}};
  for (Triangle& triangle : square) triangle.colour = {0, 200, 0};
  maker.add_plain_model(Layout::kHalfColoured, square);
}

TEST_F(PlaneTest, ModelsHideItAndAreHidden) {
  SceneMaker maker;
  add_square_pattern(maker.content);
  add_green_square(maker);
  add_picture(maker.content, "solid", add_flat(maker, 12, 0, 0, -1));
  add_picture(maker.content, "glass", add_flat(maker, 12, 0, 0, 8));
  const MappedBundle bundle(maker.content);
  auto renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_NE(renderer, nullptr);
  const DrawItem model{0, over_plane(0)};
  for (const std::uint32_t node : {0u, 1u}) {
    const DrawItem behind[] = {model, picture_at(node, over_plane(-0.5f))};
    EXPECT_EQ(texel_at(draw(*renderer, camera_above(kPlaneSide), behind), 16, 16), (Rgb{0, 200, 0}))
        << node;
    const DrawItem before[] = {model, picture_at(node, over_plane(0.5f))};
    const Rgb seen = texel_at(draw(*renderer, camera_above(kPlaneSide), before), 16, 16);
    EXPECT_NEAR(seen[1], node == 0 ? 2 : 200 * (1 - 138 / 255.0) + 1, 2) << node;
  }
}

TEST_F(PlaneTest, WhatIsSeenThroughIsDrawnFromFarToNear) {
  SceneMaker maker;
  add_square_pattern(maker.content);
  add_green_square(maker);
  add_picture(maker.content, "glass", add_flat(maker, 12, 0, 0, 8));
  const MappedBundle bundle(maker.content);
  auto renderer = make_renderer(*bundle.view, probe_gl_caps());
  ASSERT_NE(renderer, nullptr);
  DrawItem model{0, over_plane(0)};
  model.opacity = 0.5f;
  const double alpha = (8 * 17 + 2) / 255.0;
  const double red = alpha * (12 * 17 + 2);
  struct {
    float z;
    double red;
    double green;
  } const kCases[] = {{-0.5f, 0.5 * red, 100}, {0.5f, red, 100 * (1 - alpha)}};
  for (const auto& wanted : kCases) {
    const DrawItem items[] = {model, picture_at(0, over_plane(wanted.z))};
    const Rgb seen = texel_at(draw(*renderer, camera_above(kPlaneSide), items), 16, 16);
    EXPECT_NEAR(seen[0], wanted.red, 2) << wanted.z;
    EXPECT_NEAR(seen[1], wanted.green, 2.5) << wanted.z;
  }
}

/// A texture of two texels, side by side.
GLuint two_texels(const Rgb& left, const Rgb& right) {
  const std::uint8_t texels[] = {left[0], left[1], left[2], 255, right[0], right[1], right[2], 255};
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, 2, 1, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels);
  for (const GLenum filter : std::array<GLenum, 2>{GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  }
  for (const GLenum wrap : std::array<GLenum, 2>{GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T}) {
    glTexParameteri(GL_TEXTURE_2D, wrap, GL_CLAMP_TO_EDGE);
  }
  return texture;
}

TEST_F(PlaneTest, AVideoShowsItsPosterThenTheAppsTexture) {
  struct {
    VideoAlpha alpha;
    Rgb left;   ///< the visible part of the texture's left texel at the left, over black
    Rgb right;  ///< the same at the right
  } const kCases[] = {{VideoAlpha::kOpaque, {200, 100, 50}, {10, 128, 20}},
                      {VideoAlpha::kBeside, {100, 50, 25}, {100, 50, 25}},
                      {VideoAlpha::kKey, {0, 0, 0}, {10, 128, 20}}};
  for (const auto& wanted : kCases) {
    SceneMaker maker;
    add_square_pattern(maker.content);
    const std::uint32_t poster = add_flat(maker, 12, 12, 12, -1);
    add_picture(maker.content, "film", 0);
    NodeRecord& node = maker.content.nodes[0];
    node.kind = static_cast<std::uint32_t>(NodeKind::kVideo);
    node.alpha = static_cast<std::uint32_t>(wanted.alpha);
    if (wanted.alpha == VideoAlpha::kKey) {
      for (std::size_t c = 0; c < 3; ++c) node.key[c] = static_cast<float>(kCases[0].left[c]) / 255;
      node.reach = 0.25f;
    }
    MediaRecord media{};
    media.kind = static_cast<std::uint32_t>(MediaKind::kVideo);
    media.width = media.height = 2;
    media.seconds = 1.0f;
    media.poster = poster;
    maker.content.media = {media};
    maker.content.media_data = {std::vector<std::byte>(1)};
    const MappedBundle bundle(maker.content);
    auto renderer = make_renderer(*bundle.view, probe_gl_caps());
    ASSERT_NE(renderer, nullptr);
    const DrawItem item = picture_at(0, glm::scale(over_plane(0), glm::vec3(0.5f, 0.5f, 1.0f)));
    if (wanted.alpha == VideoAlpha::kOpaque) {
      const auto first = draw(*renderer, camera_above(kPlaneSide), {&item, 1});
      EXPECT_NEAR(texel_at(first, 12, 16)[0], 12 * 17 + 2, 1);
    }
    const GLuint texture = two_texels(kCases[0].left, kCases[0].right);
    renderer->set_video(0, texture);
    renderer->set_video(7, texture);  // no such node
    const auto pixels = draw(*renderer, camera_above(kPlaneSide), {&item, 1});
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(texel_at(pixels, 12, 16)[c], wanted.left[c], 1.5) << c;
      EXPECT_NEAR(texel_at(pixels, 20, 16)[c], wanted.right[c], 1.5) << c;
    }
    glDeleteTextures(1, &texture);
  }
}

TEST_F(PlaneTest, DepthRangeAndPickKnowIt) {
  SceneMaker maker;
  add_square_pattern(maker.content);
  add_picture(maker.content, "solid", add_flat(maker, 12, 5, 2, -1));
  const MappedBundle bundle(maker.content);
  const glm::mat4 flat = glm::scale(over_plane(1), glm::vec3(0.5f, 0.25f, 1.0f));
  const DrawItem item = picture_at(0, flat);
  const DepthRange range = depth_range(*bundle.view, {&item, 1});
  EXPECT_NEAR(range.near_plane, 3 * 0.99, 1e-6);
  EXPECT_NEAR(range.far_plane, 3 * 1.01, 1e-6);
  const auto found = pick(*bundle.view, camera_above(kPlaneSide), {15.5, 15.5}, {&item, 1});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->material, kNone);
  EXPECT_NEAR(found->distance, 3, 1e-3);
  // At z = 1 the picture shows 1.5 x 1.5 units: 0.25 of them are 5.3 pixels.
  EXPECT_TRUE(pick(*bundle.view, camera_above(kPlaneSide), {15.5, 15.5 + 5}, {&item, 1}));
  EXPECT_FALSE(pick(*bundle.view, camera_above(kPlaneSide), {15.5, 15.5 + 6}, {&item, 1}));
}

}  // namespace
}  // namespace modar
