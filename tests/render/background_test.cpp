// The camera's picture lands pixel on pixel, in its aspect, under the models.
#include <algorithm>
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

/// A picture in luma and chroma: random luma, one chroma pair for every 2x2 pixels, all equal so
/// that interpolation changes nothing.
struct YuvPicture {
  static constexpr int kWidth = 32;
  static constexpr int kHeight = 24;
  std::vector<std::uint8_t> luma;
  std::vector<std::uint8_t> chroma;  ///< pairs, or U then V
  CameraPicture picture;
};

YuvPicture yuv_picture(PictureFormat format, std::uint8_t u, std::uint8_t v) {
  YuvPicture made;
  std::mt19937 random(29);
  const int width = YuvPicture::kWidth;
  const int quarter = width / 2 * YuvPicture::kHeight / 2;
  for (int i = 0; i < width * YuvPicture::kHeight; ++i) {
    made.luma.push_back(static_cast<std::uint8_t>(60 + random() % 120));
  }
  for (int i = 0; i < 2 * quarter; ++i) {
    const bool is_v = format == PictureFormat::kNv21   ? i % 2 == 0
                      : format == PictureFormat::kNv12 ? i % 2 == 1
                                                       : i >= quarter;
    made.chroma.push_back(is_v ? v : u);
  }
  made.picture.format = format;
  made.picture.width = width;
  made.picture.height = YuvPicture::kHeight;
  const bool planes = format == PictureFormat::kI420;
  made.picture.planes = {made.luma.data(), made.chroma.data(),
                         planes ? made.chroma.data() + quarter : nullptr};
  made.picture.strides = {width, planes ? width / 2 : width, planes ? width / 2 : 0};
  return made;
}

std::vector<std::uint8_t> show(Renderer& renderer, const CameraPicture& picture) {
  EXPECT_TRUE(renderer.resize(picture.width, picture.height).has_value());
  renderer.render(picture, glm::mat4(1.0f), {});
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(picture.width * picture.height) * 4);
  renderer.read_pixels(pixels);
  return pixels;
}

TEST_F(BackgroundTest, ChromaBecomesColourAsBt601Says) {
  for (const PictureFormat format :
       {PictureFormat::kNv21, PictureFormat::kNv12, PictureFormat::kI420}) {
    for (const bool full : {true, false}) {
      YuvPicture made = yuv_picture(format, 110, 150);
      made.picture.full_range = full;
      const std::vector<std::uint8_t> pixels = show(*renderer_, made.picture);
      // ITU-R BT.601: R = Y + 1.402 (V - 128) and so on; limited range is stretched first.
      const double y_scale = full ? 1.0 : 255.0 / 219.0;
      const double c_scale = full ? 1.0 : 255.0 / 224.0;
      const double u = (110 - 128) * c_scale;
      const double v = (150 - 128) * c_scale;
      int wrong = 0;
      for (std::size_t i = 0; i < made.luma.size(); ++i) {
        const double y = (made.luma[i] - (full ? 0.0 : 16.0)) * y_scale;
        const double rgb[] = {y + 1.402 * v, y - 0.344136 * u - 0.714136 * v, y + 1.772 * u};
        for (std::size_t c = 0; c < 3; ++c) {
          wrong += std::abs(pixels[i * 4 + c] - std::clamp(rgb[c], 0.0, 255.0)) > 1.5;
        }
      }
      EXPECT_EQ(wrong, 0) << "format " << static_cast<int>(format) << ", full range " << full;
      EXPECT_EQ(renderer_->stats().bytes_uploaded, made.luma.size() * 3 / 2);
    }
  }
}

TEST_F(BackgroundTest, OnlyChangedRowsAreSent) {
  YuvPicture made = yuv_picture(PictureFormat::kNv21, 90, 140);
  const std::vector<std::uint8_t> before = show(*renderer_, made.picture);
  // Rows 5 to 8 change; everything else in memory is spoilt, and must not be read.
  for (std::uint8_t& luma : made.luma) luma = 255;
  made.picture.first_row = 5;
  made.picture.row_count = 4;
  const std::vector<std::uint8_t> after = show(*renderer_, made.picture);
  const int row = YuvPicture::kWidth * 4;
  for (int y = 0; y < YuvPicture::kHeight; ++y) {
    const auto at = static_cast<std::size_t>(y * row);
    const bool same = std::equal(before.begin() + static_cast<std::ptrdiff_t>(at),
                                 before.begin() + static_cast<std::ptrdiff_t>(at) + row,
                                 after.begin() + static_cast<std::ptrdiff_t>(at));
    EXPECT_EQ(same, y < 5 || y > 8) << "row " << y;
  }
  // Four rows of luma, and the three rows of pairs that they are in.
  EXPECT_EQ(renderer_->stats().bytes_uploaded, 4u * 32 + 3u * 32);
  EXPECT_EQ(renderer_->stats().bytes_same, 20u * 32 + 9u * 32);
  made.picture.row_count = 0;
  EXPECT_TRUE(after == show(*renderer_, made.picture));
  EXPECT_EQ(renderer_->stats().bytes_uploaded, 0u);
}

TEST_F(BackgroundTest, FormatsMayChangeFromFrameToFrame) {
  const Picture rgb = random_picture(32, 24, 0);
  const YuvPicture yuv = yuv_picture(PictureFormat::kI420, 128, 128);
  for (int round = 0; round < 2; ++round) {
    EXPECT_NEAR(show(*renderer_, yuv.picture)[0], yuv.luma[0], 1);
    EXPECT_EQ(draw(*renderer_, default_camera(32, 24), {}, rgb.image)[4], rgb.bytes[3]);
  }
}

TEST_F(BackgroundTest, ImpossibleSizesAreRefused) {
  EXPECT_EQ(renderer_->resize(0, 5).error().code, "gl.framebuffer");
  EXPECT_EQ(renderer_->resize(1 << 20, 5).error().code, "gl.framebuffer");
}

}  // namespace
}  // namespace modar
