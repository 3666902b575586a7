// Labels around bottles and cups: found and tracked from all sides. Truth by formulas of their own
// and OpenCV's projection; pictures by rays, which the tracker does not use.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>
#include <opencv2/calib3d.hpp>

#include "bake/pattern/pattern.hpp"
#include "bake/pattern/surface_scene.hpp"
#include "modar/pose_loop.hpp"
#include "tests/track/pose_loop_samples.hpp"

namespace modar {
namespace {

using namespace test;  // the samples

/// picture(), 300x240, on a thing.
struct Label {
  std::vector<std::byte> section;
  PatternSurface surface;
  std::vector<std::byte> bundle;
};

Label label_on(const ShapeRequest& shape) {
  Label label;
  double width_mm = 0;
  label.section = shape_section(shape, picture().cols, picture().rows, width_mm).value();
  label.surface = surface_of(label.section, picture().cols, picture().rows);
  label.bundle = bundle_of_record(gray(picture()), record(), label.section).value();
  return label;
}

const Label& can() {
  static const Label kCan = label_on({ShapeRequest::Kind::kCylinder, 66, 66, 120, {}, {}, ""});
  return kCan;
}

const Label& cup() {
  static const Label kCup = label_on({ShapeRequest::Kind::kCone, 80, 60, 110, {}, {}, ""});
  return kCup;
}

Pose seen_from(const Label& label, double around, double above, double roll, double scale) {
  return surface_pose(gray(picture()), label.surface, default_camera(kWidth, kHeight), around,
                      above, roll, scale, {0.04, -0.03});
}

SceneFrame frame_of(const Label& label, const Pose& pose, std::uint64_t seed = 3) {
  static const GrayPicture kBackground = clutter(kWidth, kHeight, 77);
  SceneBand band;
  band.surface = &label.surface;
  Random random(seed);
  const SceneLight light;
  return render_scene(gray(picture()), default_camera(kWidth, kHeight), pose, kBackground, band,
                      random, &light);
}

std::unique_ptr<PoseLoop> loop_on(const Label& label) {
  auto loop =
      PoseLoop::create(BundleView::open(label.bundle).value(), default_camera(kWidth, kHeight));
  EXPECT_TRUE(loop) << to_line(loop.error());
  return std::move(*loop);
}

/// A place of the label in space by the library's sines: x across, y up, from its middle, in shares
/// of half of its width and height.
cv::Point3d place_on(double half_arc, double slope, double x, double y) {
  const double height = 240.0 / 300.0 * y;
  const double radius = 1 / half_arc;
  const double here = radius + slope * height;
  return {here * std::sin(half_arc * x), std::sqrt(1 - slope * slope) * height,
          here * std::cos(half_arc * x) - radius};
}

std::vector<cv::Point2d> projected(const std::vector<cv::Point3d>& places, const Pose& pose) {
  const Camera camera = default_camera(kWidth, kHeight);
  cv::Matx33d turn;
  for (int i = 0; i < 9; ++i) turn(i / 3, i % 3) = pose.rotation[i % 3][i / 3];
  cv::Vec3d vector;
  cv::Rodrigues(turn, vector);
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(places, vector,
                    cv::Vec3d(pose.translation.x, pose.translation.y, pose.translation.z), matrix,
                    cv::noArray(), pixels);
  return pixels;
}

TEST(Shapes, CornersLieWhereOpenCvProjectsThem) {
  for (const Label* label : {&can(), &cup()}) {
    const double half_arc = label->surface.half_arc();
    const double slope = label->surface.slope();
    const Pose pose = seen_from(*label, 35, 20, 30, 0.9);
    const auto corners =
        projected({place_on(half_arc, slope, -1, 1), place_on(half_arc, slope, 1, 1),
                   place_on(half_arc, slope, 1, -1), place_on(half_arc, slope, -1, -1)},
                  pose);
    const SceneFrame scene = frame_of(*label, pose);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(scene.corners[i].x, corners[i].x, 1e-6);
      EXPECT_NEAR(scene.corners[i].y, corners[i].y, 1e-6);
    }
  }
  // A cup of 80 and 60 mm: its mean circumference by 110 of 360 degrees is the picture's width.
  const double width = std::numbers::pi * 70 * 110 / 360;
  EXPECT_NEAR(cup().surface.slope(), 10 / (width * 240 / 300), 1e-12);
  EXPECT_NEAR(can().surface.half_arc(), std::numbers::pi / 3, 1e-15);
}

/// White but for dark squares of 12 pixels around places of the picture: what the rays show must
/// are where OpenCV projects those places.
TEST(Shapes, RaysShowPlacesWhereOpenCvProjectsThem) {
  cv::Mat dots(240, 300, CV_8UC1, cv::Scalar(255));
  std::vector<cv::Point> centres = {{60, 50}, {150, 120}, {210, 190}};
  for (const cv::Point& at : centres) dots(cv::Rect(at.x - 6, at.y - 6, 12, 12)).setTo(0);
  const Camera camera = default_camera(kWidth, kHeight);
  for (const Label* label : {&can(), &cup()}) {
    const Pose pose = seen_from(*label, -20, 10, 15, 1.2);
    GrayPicture frame = plain(kWidth, kHeight, 0);
    draw_surface(gray(dots), label->surface, camera, pose, 0, frame);
    for (const cv::Point& at : centres) {
      const auto pixel = projected({place_on(label->surface.half_arc(), label->surface.slope(),
                                             at.x / 150.0 - 1, 1 - at.y / 120.0)},
                                   pose)[0];
      // The centre of gravity of pixels darker than their surroundings.
      double sum = 0, x = 0, y = 0;
      for (int v = static_cast<int>(pixel.y) - 14; v <= static_cast<int>(pixel.y) + 14; ++v) {
        for (int u = static_cast<int>(pixel.x) - 14; u <= static_cast<int>(pixel.x) + 14; ++u) {
          const double dark =
              std::max(0, 160 - frame.pixels[static_cast<std::size_t>(v * kWidth + u)]);
          sum += dark;
          x += dark * u;
          y += dark * v;
        }
      }
      ASSERT_GT(sum, 0);
      EXPECT_NEAR(x / sum, pixel.x, 0.15);
      EXPECT_NEAR(y / sum, pixel.y, 0.15);
    }
  }
}

TEST(Shapes, FoundFromAllSides) {
  for (const Label* label : {&can(), &cup()}) {
    const auto loop = loop_on(*label);
    for (const double around : {-60.0, -25.0, 0.0, 40.0, 60.0}) {
      const SceneFrame scene = frame_of(*label, seen_from(*label, around, 12, 20, 1.1));
      loop->reset();
      const auto result = loop->step(scene.picture.view());
      ASSERT_TRUE(result);
      ASSERT_EQ(result->visible.size(), 1u) << around << " " << to_string(result->reason);
      EXPECT_LT(worst_corner(result->visible[0], scene), 2.0) << around;
    }
    const auto nothing = loop->step(clutter(kWidth, kHeight, 5).view());
    ASSERT_TRUE(nothing);
  }
}

TEST(Shapes, TrackedAroundTheAxis) {
  const auto loop = loop_on(can());
  std::vector<double> errors;
  for (int i = 0; i < 14; ++i) {
    const double around = -60 + 5.0 * i;
    const SceneFrame scene = frame_of(can(), seen_from(can(), around, 8 + 0.5 * i, 0.7 * i, 1.1),
                                      10 + static_cast<std::uint64_t>(i));
    const auto result = loop->step(scene.picture.view());
    ASSERT_TRUE(result);
    ASSERT_EQ(result->visible.size(), 1u) << around << " " << to_string(result->reason);
    errors.push_back(worst_corner(result->visible[0], scene));
    EXPECT_LT(errors.back(), 1.5) << around;
    // The pose is that of the label's middle.
    EXPECT_LT(glm::length(result->visible[0].pose.translation - scene.pose.translation),
              0.02 * glm::length(scene.pose.translation));
  }
  std::nth_element(errors.begin(), errors.begin() + 7, errors.end());
  EXPECT_LT(errors[7], 0.05);  // 0.064 with templates as sharp as the picture
}

/// A box, and how long a millimetre of it is.
struct Box {
  Label label;
  GrayPicture atlas;
  double unit = 0;
};

const Box& carton() {
  static const Box kBox = [] {
    std::array<GrayPicture, 6> sides;
    const auto part = [](std::uint32_t seed, int width, int height) {
      const cv::Mat image = textured_picture(width, height, seed);
      return GrayPicture{width, height, {image.datastart, image.dataend}};
    };
    sides[0] = part(71, 240, 200);
    sides[1] = part(72, 160, 200);
    sides[3] = part(73, 160, 200);
    sides[4] = part(74, 240, 160);
    ShapedPicture shaped = assemble_box(sides, {120, 100, 80});
    Box box;
    box.atlas = std::move(shaped.picture);
    const GrayImage atlas = box.atlas.view();
    box.label.section = std::move(shaped.section);
    box.label.surface = surface_of(box.label.section, atlas.width, atlas.height);
    TrackerRecordOptions options;
    options.features = 1200;
    options.trial_views = 12;
    auto baked = make_tracker_record(atlas, options, box.label.surface);
    box.label.bundle = bundle_of_record(atlas, std::move(*baked), box.label.section).value();
    box.unit = 2.0 / (shaped.width_mm * std::max(atlas.width, atlas.height) / atlas.width);
    return box;
  }();
  return kBox;
}

/// Whether the box is found in one frame of that pose; its front's corners are compared with
/// OpenCV's, 120 x 100 mm about the origin.
bool found_in_place(PoseLoop& loop, const Pose& pose, std::uint64_t seed) {
  const Box& box = carton();
  SceneBand band;
  band.surface = &box.label.surface;
  static const GrayPicture kBackground = clutter(kWidth, kHeight, 78);
  Random random(seed);
  const SceneLight light;
  const SceneFrame scene = render_scene(box.atlas.view(), default_camera(kWidth, kHeight), pose,
                                        kBackground, band, random, &light);
  loop.reset();
  const auto result = loop.step(scene.picture.view());
  EXPECT_TRUE(result);
  if (!result || result->visible.empty()) return false;
  const double x = 60 * box.unit;
  const double y = 50 * box.unit;
  const auto corners = projected({{-x, y, 0}, {x, y, 0}, {x, -y, 0}, {-x, -y, 0}}, pose);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(result->visible[0].corners[i].x, corners[i].x, 2.0) << seed;
    EXPECT_NEAR(result->visible[0].corners[i].y, corners[i].y, 2.0) << seed;
  }
  return true;
}

/// Two sides of a box show: its pose is one, whichever of them is found first.
TEST(Shapes, ABoxIsFoundByItsSides) {
  ASSERT_EQ(carton().label.surface.faces().size(), 4u);
  const auto loop = loop_on(carton().label);
  for (const double around : {-40.0, 10.0, 55.0}) {
    const Pose pose = surface_pose(carton().atlas.view(), carton().label.surface,
                                   default_camera(kWidth, kHeight), around, 20, 10, 0.9, {0, 0});
    EXPECT_TRUE(found_in_place(*loop, pose, 9)) << around;
  }
}

/// The mirror image of a pose shows one face nearly alike: the others tell which it is.
TEST(Shapes, ABoxIsNotFoundMirrored) {
  const auto loop = loop_on(carton().label);
  SceneBand band;
  band.surface = &carton().label.surface;
  band.area_low = 0.1;
  band.area_high = 0.5;
  band.tilt_high = 25;
  band.around_low = 20;
  band.around_high = 75;
  Random random(5);
  int found = 0;
  for (std::uint64_t i = 0; i < 24; ++i) {
    const Pose pose =
        draw_pose(band, carton().atlas.view(), default_camera(kWidth, kHeight), random);
    found += found_in_place(*loop, pose, i) ? 1 : 0;
  }
  EXPECT_GE(found, 21);
}

TEST(Shapes, BadSectionsAreRefused) {
  std::vector<std::byte> section = can().section;
  section[8 + 7] = std::byte{0x7F};  // its arc is far above a turn
  const auto bundle = bundle_of_record(gray(picture()), record(), section);
  ASSERT_TRUE(bundle);
  EXPECT_FALSE(BundleView::open(*bundle));
}

}  // namespace
}  // namespace modar
