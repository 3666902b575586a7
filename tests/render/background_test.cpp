// The camera's picture lands pixel on pixel, in its aspect, under the models.
#include <random>

#include <glm/gtc/matrix_transform.hpp>

#include "tests/render/scene.hpp"

namespace modar {
namespace {

struct Picture {
  std::vector<std::uint8_t> bytes;
  RgbImage image;
};

/// Random pixels, with `padding` bytes after each row.
Picture random_picture(int width, int height, int padding) {
  Picture picture;
  const std::ptrdiff_t stride = 3 * width + padding;
  picture.bytes.resize(static_cast<std::size_t>(stride * height));
  std::mt19937 random(17);
  for (std::uint8_t& byte : picture.bytes) byte = static_cast<std::uint8_t>(random());
  picture.image = {picture.bytes.data(), width, height, stride};
  return picture;
}

class BackgroundTest : public GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    if (IsSkipped()) return;
    SceneMaker maker;
    Triangle triangle;
    triangle.corners = {glm::dvec3(-1, -1, 0), {1, -1, 0}, {0, 1, 0}};
    triangle.colour = {10, 250, 30};
    maker.add_plain_model(Layout::kHalfColoured, {triangle});
    bundle_ = std::make_unique<MappedBundle>(maker.content);
    renderer_ = make_renderer(*bundle_->view, probe_gl_caps());
  }
  void TearDown() override {
    renderer_.reset();
    bundle_.reset();
  }

  std::unique_ptr<MappedBundle> bundle_;
  std::unique_ptr<Renderer> renderer_;
};

TEST_F(BackgroundTest, EqualSizesAreExactWhateverTheStride) {
  for (const int padding : {0, 1, 7}) {
    // Odd sides: no power of two, no alignment.
    const Picture picture = random_picture(61, 37, padding);
    const std::vector<std::uint8_t> pixels =
        draw(*renderer_, default_camera(61, 37), {}, picture.image);
    int wrong = 0;
    for (int y = 0; y < 37; ++y) {
      for (int x = 0; x < 61; ++x) {
        for (int c = 0; c < 3; ++c) {
          wrong += pixels[static_cast<std::size_t>((y * 61 + x) * 4 + c)] !=
                   picture.image.pixels[y * picture.image.stride + 3 * x + c];
        }
      }
    }
    EXPECT_EQ(wrong, 0) << "padding " << padding;
    EXPECT_EQ(renderer_->stats().draw_calls, 1);
    EXPECT_EQ(renderer_->stats().bytes_uploaded, 61u * 37u * 3u);
  }
}

TEST_F(BackgroundTest, AnotherAspectIsCentredBetweenBars) {
  std::vector<std::uint8_t> bytes(40 * 20 * 3, 180);
  const RgbImage image{bytes.data(), 40, 20, 120};
  ASSERT_TRUE(renderer_->resize(60, 60).has_value());
  renderer_->render(image, glm::mat4(1.0f), {});
  std::vector<std::uint8_t> pixels(60 * 60 * 4);
  renderer_->read_pixels(pixels);
  // 40x20 in 60x60: 60x30, 15 rows above and below.
  for (int y = 0; y < 60; ++y) {
    const int expected = y >= 15 && y < 45 ? 180 : 0;
    EXPECT_EQ(pixels[static_cast<std::size_t>((y * 60 + 30) * 4)], expected) << "row " << y;
  }
}

TEST_F(BackgroundTest, ModelsStandBeforeIt) {
  const Picture picture = random_picture(64, 64, 0);
  Camera camera = default_camera(64, 64);
  const DrawItem item{0, glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, -4.0f))};
  const std::vector<std::uint8_t> pixels = draw(*renderer_, camera, {&item, 1}, picture.image);
  const std::size_t middle = (32 * 64 + 32) * 4;
  EXPECT_EQ(pixels[middle], 10);
  EXPECT_EQ(pixels[middle + 1], 250);
  EXPECT_EQ(pixels[0], picture.bytes[0]);
  EXPECT_EQ(pixels[1], picture.bytes[1]);
}

TEST_F(BackgroundTest, SizesMayChangeFromFrameToFrame) {
  for (const int side : {16, 48, 24}) {
    const Picture picture = random_picture(side, side, 0);
    const std::vector<std::uint8_t> pixels =
        draw(*renderer_, default_camera(side, side), {}, picture.image);
    const std::size_t last = static_cast<std::size_t>(side * side) - 1;
    EXPECT_EQ(pixels[last * 4], picture.bytes[last * 3]) << side;
  }
}

TEST_F(BackgroundTest, ImpossibleSizesAreRefused) {
  EXPECT_EQ(renderer_->resize(0, 5).error().code, "gl.framebuffer");
  EXPECT_EQ(renderer_->resize(1 << 20, 5).error().code, "gl.framebuffer");
}

}  // namespace
}  // namespace modar
