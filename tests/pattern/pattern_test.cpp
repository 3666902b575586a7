// Rectifying photos, PNG files with a physical size, and baking patterns.
#include "bake/pattern/pattern.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include <random>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "modar/features.hpp"

namespace modar {
namespace {

/// Smooth in every direction, so that resampling errors stay small and positions show in values.
RgbaImage waves(std::uint32_t width, std::uint32_t height) {
  RgbaImage image{width, height, std::vector<std::uint8_t>(std::size_t{width} * height * 4, 255)};
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      std::uint8_t* p = image.pixels.data() + 4 * (std::size_t{y} * width + x);
      p[0] = static_cast<std::uint8_t>(127 + 120 * std::sin(x * 0.05));
      p[1] = static_cast<std::uint8_t>(127 + 120 * std::sin(y * 0.04));
      p[2] = static_cast<std::uint8_t>(127 + 120 * std::sin((x + y) * 0.03));
    }
  }
  return image;
}

std::string temporary(const std::string& name) {
  return (std::filesystem::temp_directory_path() /
          ("modar_pattern_" + std::to_string(::getpid()) + name))
      .string();
}

struct RemoveAtEnd {
  std::string path;
  ~RemoveAtEnd() { std::remove(path.c_str()); }
};

TEST(PatternColours, AreMeansInLinearLight) {
  // Cells of 2 x 2 pixels: two black, two of 188, which is 1/2 in linear light (IEC 61966-2-1);
  // blue only where nothing else is.
  RgbaImage image{16, 16, std::vector<std::uint8_t>(16 * 16 * 4, 255)};
  for (std::size_t i = 0; i < 16 * 16; ++i) {
    std::uint8_t* p = &image.pixels[4 * i];
    p[0] = p[1] = i % 2 == 0 ? 0 : 188;
    p[2] = i < 128 ? 0 : 255;
  }
  image.pixels[3] = 0;  // the first pixel is paper
  const auto section = pattern_colours(image);
  ASSERT_EQ(section.size(), 16u + 8 * 8 * 6);
  const auto value = [&](std::size_t cell, std::size_t channel) {
    std::uint16_t code = 0;
    std::memcpy(&code, section.data() + 16 + 6 * cell + 2 * channel, 2);
    return code / 65535.0;
  };
  EXPECT_NEAR(value(9, 0), 0.25, 0.002);
  EXPECT_NEAR(value(9, 2), 0.0, 1e-9);
  EXPECT_NEAR(value(63, 1), 0.25, 0.002);
  EXPECT_NEAR(value(63, 2), 1.0, 1e-9);
  EXPECT_NEAR(value(0, 0), 0.5, 0.002);
  EXPECT_NEAR(value(0, 2), 0.25, 1e-4);
}

TEST(Rectify, AnUprightRectangleIsCutOutAsItIs) {
  const RgbaImage photo = waves(640, 480);
  RectifyOptions options;
  options.corners = {PixelPoint{99.5, 59.5}, {399.5, 59.5}, {399.5, 259.5}, {99.5, 259.5}};
  const auto cut = rectify(photo, options);
  ASSERT_TRUE(cut) << to_line(cut.error());
  ASSERT_EQ(cut->image.width, 300u);
  ASSERT_EQ(cut->image.height, 200u);
  for (std::uint32_t y = 0; y < 200; y += 7) {
    for (std::uint32_t x = 0; x < 300; x += 7) {
      for (std::uint32_t c = 0; c < 4; ++c) {
        EXPECT_NEAR(cut->image.pixels[4 * (y * 300 + x) + c],
                    photo.pixels[4 * ((y + 60) * 640 + x + 100) + c], 2);
      }
    }
  }
}

/// The corners of a rectangle of that aspect, photographed at an angle.
std::array<PixelPoint, 4> photographed(double aspect, double tilt_x, double tilt_y, double focal) {
  const cv::Matx33d k(focal, 0, 499.5, 0, focal, 374.5, 0, 0, 1);
  std::vector<cv::Point2d> seen;
  cv::projectPoints(
      std::vector<cv::Point3d>{{-aspect, -1, 0}, {aspect, -1, 0}, {aspect, 1, 0}, {-aspect, 1, 0}},
      cv::Vec3d(tilt_x, tilt_y, 0.1), cv::Vec3d(0.1, 0.05, 6), k, cv::noArray(), seen);
  std::array<PixelPoint, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = {seen[i].x, seen[i].y};
  return corners;
}

TEST(Rectify, ThePerspectiveTellsTheAspectRatio) {
  const RgbaImage photo = waves(1000, 750);
  for (const double aspect : {0.6, 1.0, 1.5}) {
    RectifyOptions options;
    options.corners = photographed(aspect, 0.5, -0.4, 900);
    const auto flat = rectify(photo, options);
    ASSERT_TRUE(flat) << to_line(flat.error());
    EXPECT_NEAR(static_cast<double>(flat->image.width) / flat->image.height, aspect, 0.02 * aspect);
  }
}

TEST(Rectify, SizesInMillimetresDecideTheAspectRatio) {
  RectifyOptions options;
  options.corners = photographed(1.0, 0.5, -0.4, 900);
  options.width_mm = 200;
  options.height_mm = 100;
  const auto flat = rectify(waves(1000, 750), options);
  ASSERT_TRUE(flat);
  EXPECT_NEAR(static_cast<double>(flat->image.width) / flat->image.height, 2.0, 0.02);
}

// The value at each place of the result is that of the photo where the pinhole model puts it.
TEST(Rectify, SamplesThePhotoWhereTheHomographySays) {
  const RgbaImage photo = waves(1000, 750);
  RectifyOptions options;
  options.corners = photographed(1.5, 0.4, 0.3, 900);
  options.width_mm = 300;
  options.height_mm = 200;
  options.max_side = 200;
  const auto flat = rectify(photo, options);
  ASSERT_TRUE(flat);
  ASSERT_EQ(flat->image.width, 200u);
  const float w = static_cast<float>(flat->image.width);
  const float h = static_cast<float>(flat->image.height);
  std::vector<cv::Point2f> from = {{0, 0}, {w, 0}, {w, h}, {0, h}};
  std::vector<cv::Point2f> to;
  for (const PixelPoint& c : options.corners)
    to.emplace_back(static_cast<float>(c.x), static_cast<float>(c.y));
  const cv::Mat map = cv::getPerspectiveTransform(from, to);
  for (std::uint32_t y = 5; y < flat->image.height; y += 20) {
    for (std::uint32_t x = 5; x < flat->image.width; x += 20) {
      std::vector<cv::Point2f> at = {{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f}};
      cv::perspectiveTransform(at, at, map);
      EXPECT_NEAR(flat->image.pixels[4 * (y * flat->image.width + x)],
                  127 + 120 * std::sin(at[0].x * 0.05f), 5);
      EXPECT_NEAR(flat->image.pixels[4 * (y * flat->image.width + x) + 1],
                  127 + 120 * std::sin(at[0].y * 0.04f), 5);
    }
  }
}

// Lenses of phones, tilted by up to 45 degrees, corners off by up to a pixel: the aspect is found,
// and its error is what the estimate says of it.
TEST(Rectify, TheSpreadOfTheAspectIsHonest) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  constexpr int kViews = 400;
  std::vector<double> errors;
  int within = 0;
  for (int i = 0; i < kViews; ++i) {
    const double aspect = std::exp(0.6 * any(random));
    auto corners =
        photographed(aspect, 0.5 * any(random), 0.5 * any(random), 760 + 60 * any(random));
    for (PixelPoint& corner : corners) {
      corner.x += any(random);
      corner.y += any(random);
    }
    const AspectEstimate found = estimate_aspect(corners, 1000, 750, 0);
    errors.push_back(std::fabs(found.aspect / aspect - 1));
    within += std::fabs(found.aspect - aspect) < 2 * found.spread ? 1 : 0;
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[kViews / 2], 0.01);
  EXPECT_LT(errors.back(), 0.05);
  EXPECT_GT(within, kViews * 95 / 100);
}

TEST(Rectify, ACroppedPhotoSaysHowLittleItTellsOfTheShape) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(-1, 1);
  constexpr int kViews = 200;
  int within = 0;
  int doubted = 0;
  for (int i = 0; i < kViews; ++i) {
    const double aspect = std::exp(0.4 * any(random));
    auto corners = photographed(aspect, 0.5 * any(random), 0.5 * any(random), 790);
    PixelPoint low = corners[0];
    PixelPoint high = corners[0];
    for (const PixelPoint& corner : corners) {
      low = {std::min(low.x, corner.x), std::min(low.y, corner.y)};
      high = {std::max(high.x, corner.x), std::max(high.y, corner.y)};
    }
    for (PixelPoint& corner : corners) corner = {corner.x - low.x + 60, corner.y - low.y + 60};
    const auto width = static_cast<std::uint32_t>(high.x - low.x) + 120;
    const auto height = static_cast<std::uint32_t>(high.y - low.y) + 120;
    const AspectEstimate found = estimate_aspect(corners, width, height, 0);
    within += std::fabs(std::log(found.aspect / aspect)) < 2 * found.spread / found.aspect ? 1 : 0;
    doubted += found.spread > 0.1 * found.aspect ? 1 : 0;
  }
  EXPECT_GT(within, kViews * 93 / 100);
  EXPECT_GT(doubted, kViews / 2);
}

TEST(Rectify, TheFocalLengthOfThePhotoDecidesWhereItIsKnown) {
  const auto corners = photographed(1.0, 0.1, -0.6, 2000);
  const AspectEstimate usual = estimate_aspect(corners, 1000, 750, 0);
  const AspectEstimate known = estimate_aspect(corners, 1000, 750, 2000);
  EXPECT_GT(std::fabs(usual.aspect - 1), 0.01);
  EXPECT_NEAR(known.aspect, 1.0, 0.005);
  EXPECT_LT(known.spread, usual.spread);
}

TEST(Rectify, CornersThatAreNoQuadrilateralAreRefused) {
  const RgbaImage photo = waves(640, 480);
  const double nan = std::nan("");
  const std::vector<std::array<PixelPoint, 4>> bad = {
      {PixelPoint{100, 100}, {100, 300}, {300, 300}, {300, 100}},  // counter-clockwise
      {PixelPoint{100, 100}, {300, 300}, {300, 100}, {100, 300}},  // crossed
      {PixelPoint{100, 100}, {200, 100}, {300, 100}, {100, 300}},  // collinear
      {PixelPoint{100, 100}, {300, 100}, {150, 150}, {100, 300}},  // concave
      {PixelPoint{100, 100}, {110, 100}, {110, 110}, {100, 110}},  // too small
      {PixelPoint{100, 100}, {700, 100}, {700, 300}, {100, 300}},  // outside
      {PixelPoint{nan, 100}, {300, 100}, {300, 300}, {100, 300}}, {PixelPoint{}, {}, {}, {}}};
  for (std::size_t i = 0; i < bad.size(); ++i) {
    RectifyOptions options;
    options.corners = bad[i];
    const auto flat = rectify(photo, options);
    ASSERT_FALSE(flat) << i;
    EXPECT_EQ(flat.error().code, "rectify.corners") << i;
  }
}

TEST(PatternPng, KeepsPixelsAndPhysicalWidth) {
  const RemoveAtEnd file{temporary("size.png")};
  const RgbaImage image = waves(360, 240);
  ASSERT_TRUE(write_png(image, file.path, 180.0));
  // 360 pixels on 180 mm are 2000 pixels a metre.
  EXPECT_DOUBLE_EQ(png_width_mm(file.path), 180.0);
  const cv::Mat read = cv::imread(file.path, cv::IMREAD_COLOR);
  ASSERT_EQ(read.size(), cv::Size(360, 240));
  for (int y = 0; y < 240; y += 11) {
    for (int x = 0; x < 360; x += 11) {
      const cv::Vec3b bgr = read.at<cv::Vec3b>(y, x);
      const std::uint8_t* p = image.pixels.data() + 4 * (y * 360 + x);
      EXPECT_EQ(bgr, cv::Vec3b(p[2], p[1], p[0]));
    }
  }
}

TEST(PatternPng, ThePhysChunkIsByteForByteWhatThePngSpecificationAsksFor) {
  const RemoveAtEnd file{temporary("chunk.png")};
  ASSERT_TRUE(write_png(waves(64, 64), file.path, 64.0 / 11811 * 1000));
  std::ifstream stream(file.path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  // 11811 pixels a metre (300 dpi): a chunk, with its CRC, that many PNG files of other tools hold.
  const unsigned char expected[] = {0,    0, 0, 9,    'p',  'H', 'Y',  's',  0,    0,   0x2E,
                                    0x23, 0, 0, 0x2E, 0x23, 1,   0x78, 0xA5, 0x3F, 0x76};
  const std::size_t at =
      bytes.find(std::string(reinterpret_cast<const char*>(expected), sizeof expected));
  ASSERT_NE(at, std::string::npos);
  EXPECT_NEAR(png_width_mm(file.path), 64 / 11.811, 1e-9);
  // 72 dpi: what programs write that nobody has told a size.
  const unsigned char usual[] = {0,    0, 0, 9,    'p',  'H', 'Y',  's',  0,    0,   0x0B,
                                 0x13, 0, 0, 0x0B, 0x13, 1,   0x00, 0x9A, 0x9C, 0x18};
  bytes.replace(at, sizeof usual, reinterpret_cast<const char*>(usual), sizeof usual);
  std::ofstream(file.path, std::ios::binary) << bytes;
  EXPECT_EQ(png_width_mm(file.path), 0.0);
}

TEST(PatternPng, AStatedWidthComesBackEvenAtAUsualResolution) {
  const RemoveAtEnd file{temporary("usual.png")};
  for (const double dpi : {72.0, 96.0, 144.0}) {
    const double width = 640 / dpi * 25.4;
    ASSERT_TRUE(write_png(waves(640, 64), file.path, width));
    EXPECT_NEAR(png_width_mm(file.path), width, 0.001 * width);
  }
}

TEST(PatternPng, FilesWithoutASizeAnswerZero) {
  const RemoveAtEnd file{temporary("none.png")};
  ASSERT_TRUE(write_png(waves(64, 64), file.path, 0.0));
  EXPECT_EQ(png_width_mm(file.path), 0.0);
  EXPECT_EQ(png_width_mm("/nowhere/at/all.png"), 0.0);
  std::ifstream stream(file.path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  for (std::size_t size : {0u, 7u, 20u, 33u, 40u}) {
    std::ofstream(file.path, std::ios::binary) << bytes.substr(0, size);
    EXPECT_EQ(png_width_mm(file.path), 0.0);
  }
}

cv::Mat speckled(int width, int height) {
  cv::Mat picture(height, width, CV_8UC3, cv::Scalar(90, 110, 130));
  cv::RNG random(17);
  for (int i = 0; i < width * height / 300; ++i) {
    const cv::Point at(random.uniform(0, width), random.uniform(0, height));
    const int side = random.uniform(3, 25);
    cv::rectangle(
        picture, at, at + cv::Point(side, side),
        cv::Scalar(random.uniform(0, 256), random.uniform(0, 256), random.uniform(0, 256)),
        cv::FILLED);
  }
  return picture;
}

TrackerRecordOptions quick() {
  TrackerRecordOptions options;
  options.features = 300;
  options.trial_views = 8;
  options.score = false;
  return options;
}

TEST(BakePattern, HoldsTheFourSetsTwiceAndTheNormalisedSize) {
  const RemoveAtEnd file{temporary("speckled.png")};
  ASSERT_TRUE(cv::imwrite(file.path, speckled(400, 300)));
  Report report;
  const auto baked = bake_pattern(file.path, 120.0, paper_parameter_sets(), quick(), report);
  ASSERT_TRUE(baked) << to_line(baked.error());
  EXPECT_EQ(baked->record.width, 400u);
  EXPECT_EQ(baked->record.height, 300u);
  EXPECT_EQ(baked->record.width_mm, 120.0);
  EXPECT_EQ(baked->record.half_width, 1.0f);
  EXPECT_EQ(baked->record.half_height, 0.75f);
  EXPECT_EQ(baked->record.score, -1.0f);
  EXPECT_EQ(baked->name, std::filesystem::path(file.path).stem().string());
  ASSERT_EQ(baked->features.size(), 4u);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const FeatureContent& content = baked->features[i];
    EXPECT_EQ(content.set_id, i + 1);
    const auto from_yml = features_from_yml(content.yml);
    ASSERT_TRUE(from_yml);
    EXPECT_EQ(from_yml->descriptors, content.descriptors);
    EXPECT_EQ(from_yml->keypoints.size(), content.keypoints.size());
    EXPECT_GT(content.keypoints.size(), 50u);
  }
  ASSERT_EQ(report.stages.size(), 1u);
  EXPECT_EQ(report.stages[0].in, 120000u);
}

TEST(BakePattern, LargePicturesAreBroughtToThePatternsOfTheArticle) {
  const RemoveAtEnd file{temporary("large.png")};
  ASSERT_TRUE(cv::imwrite(file.path, speckled(1440, 400)));
  Report report;
  const auto baked = bake_pattern(file.path, 0.0, {}, quick(), report);
  ASSERT_TRUE(baked) << to_line(baked.error());
  EXPECT_EQ(baked->record.width, 720u);
  EXPECT_EQ(baked->record.height, 200u);
  ASSERT_EQ(report.diagnostics.size(), 1u);
  EXPECT_EQ(report.diagnostics[0].id, "pattern.resized");
}

TEST(BakePattern, TakesTheWidthThatThePngStates) {
  const RemoveAtEnd file{temporary("stated.png")};
  const cv::Mat picture = speckled(120, 120);
  cv::Mat rgba;
  cv::cvtColor(picture, rgba, cv::COLOR_BGR2RGBA);
  RgbaImage image{120, 120, {rgba.data, rgba.data + rgba.total() * 4}};
  ASSERT_TRUE(write_png(image, file.path, 150.0));
  Report report;
  for (const auto& [given, told] : {std::pair{0.0, 150.0}, {99.0, 99.0}}) {
    const auto baked = bake_pattern(file.path, given, {}, quick(), report);
    ASSERT_TRUE(baked) << to_line(baked.error());
    EXPECT_DOUBLE_EQ(baked->record.width_mm, told);
  }
}

TEST(BakePattern, APictureWithoutTextureIsRefused) {
  const RemoveAtEnd file{temporary("blank.png")};
  ASSERT_TRUE(cv::imwrite(file.path, cv::Mat(300, 300, CV_8UC3, cv::Scalar(200, 200, 200))));
  Report report;
  const auto baked = bake_pattern(file.path, 0.0, paper_parameter_sets(), quick(), report);
  ASSERT_FALSE(baked);
  EXPECT_EQ(baked.error().code, "pattern.no-features");
  EXPECT_EQ(baked.error().where, file.path);
  EXPECT_FALSE(bake_pattern("/nowhere/at/all.png", 0.0, paper_parameter_sets(), quick(), report));
}

}  // namespace
}  // namespace modar
