// Frames that show a pattern under light that we choose, made pixel by pixel.
#include "runtime/render/light_estimate.hpp"

#include <cmath>
#include <cstring>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/matrix.hpp>

#include "formats/colour_grid.hpp"
#include "modar/camera.hpp"

namespace modar {
namespace {

constexpr std::size_t kCells = 8;
constexpr std::size_t kFrameWidth = 320;
constexpr std::size_t kFrameHeight = 240;

double stored(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);
  return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
}

/// A pattern of coloured squares, seen at a slant.
class Shown {
 public:
  Shown() {
    pattern_.half_width = 1.0f;
    pattern_.half_height = 0.75f;
    std::mt19937 random(7);
    const ColourGridHeader header{kCells, kCells, {}};
    section_.resize(sizeof header + 6 * kCells * kCells);
    std::memcpy(section_.data(), &header, sizeof header);
    for (std::size_t i = 0; i < kCells * kCells; ++i) {
      for (int c = 0; c < 3; ++c) {
        const auto code = static_cast<std::uint16_t>(3000 + random() % 50000);
        std::memcpy(section_.data() + sizeof header + 6 * i + 2 * static_cast<std::size_t>(c),
                    &code, 2);
        cells_[i][c] = code / 65535.0;
      }
    }
    world_ = glm::lookAt(glm::vec3(0.3f, -1.6f, 2.2f), glm::vec3(0.0f), glm::vec3(0, 0, 1));
  }

  /// light(x, y): what a white surface gets at a place of the pattern, linear.
  void paint(const std::function<glm::dvec3(double, double)>& light) {
    rgb_.assign(3 * kFrameWidth * kFrameHeight, 128);
    const glm::dmat4 back = glm::inverse(glm::dmat4(matrix()));
    for (std::size_t y = 0; y < kFrameHeight; ++y) {
      for (std::size_t x = 0; x < kFrameWidth; ++x) {
        const double nx = 2 * (static_cast<double>(x) + 0.5) / kFrameWidth - 1;
        const double ny = 1 - 2 * (static_cast<double>(y) + 0.5) / kFrameHeight;
        glm::dvec4 a = back * glm::dvec4(nx, ny, -1, 1);
        glm::dvec4 b = back * glm::dvec4(nx, ny, 1, 1);
        a /= a.w;
        b /= b.w;
        const glm::dvec4 p = a + (b - a) * (a.z / (a.z - b.z));
        const double column = std::floor((p.x + 1) / 2 * kCells);
        const double row = std::floor((0.75 - p.y) / 1.5 * kCells);
        if (column < 0 || row < 0 || column >= kCells || row >= kCells) continue;
        const glm::dvec3 given = light(p.x, p.y);
        const glm::dvec3& cell =
            cells_[static_cast<std::size_t>(row) * kCells + static_cast<std::size_t>(column)];
        for (int c = 0; c < 3; ++c) {
          rgb_[3 * (y * kFrameWidth + x) + static_cast<std::size_t>(c)] =
              static_cast<std::uint8_t>(std::lround(255 * stored(cell[c] * given[c])));
        }
      }
    }
  }

  void make_gray() {
    for (std::size_t i = 0; i < rgb_.size(); i += 3) {
      const auto gray = static_cast<std::uint8_t>(
          (299 * rgb_[i] + 587 * rgb_[i + 1] + 114 * rgb_[i + 2] + 500) / 1000);
      rgb_[i] = rgb_[i + 1] = rgb_[i + 2] = gray;
    }
  }

  [[nodiscard]] CameraPicture rgb() const {
    CameraPicture frame;
    frame.width = kFrameWidth;
    frame.height = kFrameHeight;
    frame.planes[0] = rgb_.data();
    frame.strides[0] = 3 * kFrameWidth;
    return frame;
  }

  /// The same as a camera of a phone hands it out.
  CameraPicture nv21() {
    luma_.assign(kFrameWidth * kFrameHeight, 0);
    chroma_.assign(kFrameWidth * kFrameHeight / 2, 0);
    for (std::size_t y = 0; y < kFrameHeight; ++y) {
      for (std::size_t x = 0; x < kFrameWidth; ++x) {
        const std::uint8_t* p = &rgb_[3 * (y * kFrameWidth + x)];
        const double gray = 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
        luma_[y * kFrameWidth + x] = static_cast<std::uint8_t>(std::lround(gray));
        if (x % 2 != 0 || y % 2 != 0) continue;
        const auto chroma = [](double v) {
          return static_cast<std::uint8_t>(std::lround(std::clamp(128 + v, 0.0, 255.0)));
        };
        std::uint8_t* pair = &chroma_[y / 2 * kFrameWidth + x];
        pair[0] = chroma((p[0] - gray) / 1.402);
        pair[1] = chroma((p[2] - gray) / 1.772);
      }
    }
    CameraPicture frame;
    frame.format = PictureFormat::kNv21;
    frame.width = kFrameWidth;
    frame.height = kFrameHeight;
    frame.planes = {luma_.data(), chroma_.data(), nullptr};
    frame.strides = {kFrameWidth, kFrameWidth, 0};
    return frame;
  }

  [[nodiscard]] glm::mat4 matrix() const {
    return gl_projection(default_camera(kFrameWidth, kFrameHeight), 0.1, 10.0) * world_;
  }
  [[nodiscard]] PlaneLight look(const CameraPicture& frame) const {
    return look_at_pattern(frame, matrix(), pattern_, section_);
  }

  glm::mat4 world_{1.0f};

 private:
  PatternRecord pattern_{};
  std::vector<std::byte> section_;
  std::array<glm::dvec3, kCells * kCells> cells_{};
  std::vector<std::uint8_t> rgb_;
  std::vector<std::uint8_t> luma_;
  std::vector<std::uint8_t> chroma_;
};

/// Within a few percent of each channel.
void expect_light(const PlaneLight& light, const glm::dvec3& wanted, double part) {
  ASSERT_TRUE(light.known);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(static_cast<double>(light.middle[c]) / wanted[c], 1.0, part) << c;
  }
}

TEST(LightEstimate, TellsBrightnessAndColour) {
  Shown shown;
  for (const glm::dvec3& wanted : {glm::dvec3(1, 1, 1), {0.3, 0.3, 0.3}, {0.5, 0.4, 0.25}}) {
    shown.paint([&](double, double) { return wanted; });
    expect_light(shown.look(shown.rgb()), wanted, 0.04);
    expect_light(shown.look(shown.nv21()), wanted, 0.06);
  }
}

TEST(LightEstimate, TellsWhereItIsBrighter) {
  Shown shown;
  shown.paint([](double x, double y) { return glm::dvec3(0.5 * (1 + 0.4 * x - 0.25 * y)); });
  const PlaneLight light = shown.look(shown.rgb());
  expect_light(light, glm::dvec3(0.5), 0.05);
  EXPECT_NEAR(light.slope.x, 0.4, 0.06);
  EXPECT_NEAR(light.slope.y, -0.25, 0.06);
}

TEST(LightEstimate, AHandOnThePatternIsNotLight) {
  Shown shown;
  shown.paint([](double x, double) { return glm::dvec3(x < -0.45 ? 0.02 : 0.6); });
  expect_light(shown.look(shown.rgb()), glm::dvec3(0.6), 0.06);
}

TEST(LightEstimate, AGrayFrameTellsBrightnessAlone) {
  Shown shown;
  shown.paint([](double, double) { return glm::dvec3(0.5, 0.5, 0.5); });
  shown.make_gray();
  const PlaneLight light = shown.look(shown.rgb());
  ASSERT_TRUE(light.known);
  EXPECT_EQ(light.middle.r, light.middle.g);
  EXPECT_EQ(light.middle.r, light.middle.b);
  EXPECT_NEAR(light.middle.g, 0.5, 0.05);
}

TEST(LightEstimate, NothingIsKnownOfWhatIsNotSeen) {
  Shown shown;
  shown.paint([](double, double) { return glm::dvec3(0.0); });
  EXPECT_FALSE(shown.look(shown.rgb()).known) << "black";
  shown.paint([](double, double) { return glm::dvec3(200.0); });
  EXPECT_FALSE(shown.look(shown.rgb()).known) << "white";
  shown.paint([](double, double) { return glm::dvec3(0.5); });
  shown.world_ = glm::translate(glm::mat4(1.0f), glm::vec3(1.9f, 0, 0)) * shown.world_;
  EXPECT_FALSE(shown.look(shown.rgb()).known) << "next to the frame";
  shown.world_ = glm::mat4(0.0f);
  EXPECT_FALSE(shown.look(shown.rgb()).known) << "no pose";
}

}  // namespace
}  // namespace modar
