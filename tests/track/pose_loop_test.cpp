// Our own pose loop from end to end: a record baked from a picture, frames rendered by the bench's
// renderer, and input that means harm.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <opencv2/imgproc.hpp>

#include "bake/pattern/pattern.hpp"
#include "formats/tracker_record.hpp"
#include "modar/pose_loop.hpp"
#include "runtime/track/pose_refinement.hpp"
#include "tests/track/pose_loop_samples.hpp"
#include "tests/track/synthetic.hpp"

namespace modar {
namespace {

using namespace test;  // the samples

// Bands mean what the eye sees: the tilt to the line of sight, wherever the pattern stands.
TEST(Scene, PosesHaveTheTiltAndTheAreaOfTheirBand) {
  const Camera camera = default_camera(640, 480);
  SceneBand band;
  band.area_low = 0.2;
  band.area_high = 0.3;
  band.tilt_low = 60;
  band.tilt_high = 70;
  Random random(12);
  double farthest = 0;
  for (int i = 0; i < 200; ++i) {
    const Pose pose = draw_pose(band, test::gray(picture()), camera, random);
    const glm::dvec3 sight = glm::normalize(pose.translation);
    const double tilt =
        glm::degrees(std::acos(std::abs(glm::dot(sight, glm::normalize(pose.rotation[2])))));
    EXPECT_GT(tilt, 60 - 1e-6) << i;
    EXPECT_LT(tilt, 70 + 1e-6) << i;
    EXPECT_NEAR(glm::determinant(pose.rotation), 1, 1e-9);
    std::vector<cv::Point2f> outline;
    for (const glm::dvec2 corner : {glm::dvec2{-1, 0.8}, {1, 0.8}, {1, -0.8}, {-1, -0.8}}) {
      const glm::dvec3 p = pose.rotation * glm::dvec3(corner, 0) + pose.translation;
      ASSERT_GT(p.z, 0);
      const glm::dvec2 at = project(camera, p);
      outline.emplace_back(static_cast<float>(at.x), static_cast<float>(at.y));
    }
    const double area = cv::contourArea(outline, true) / (300.0 * 240.0);
    EXPECT_GT(area, 0.2 - 1e-3) << i;
    EXPECT_LT(area, 0.3 + 1e-3) << i;
    farthest = std::max(farthest, std::abs(sight.x));
  }
  EXPECT_GT(farthest, 0.2);  // not in the middle alone
}

// A page of digits took every feature of a frame, and no pattern on it was ever found.
TEST(TrackerFeatures, PrintLeavesRoomForAPictureOnIt) {
  cv::Mat frame(480 / 4, 640 / 4, CV_8UC1);
  cv::RNG noise(3);
  noise.fill(frame, cv::RNG::UNIFORM, 0, 256);
  cv::resize(frame > 127, frame, {640, 480}, 0, 0, cv::INTER_NEAREST);
  const cv::Rect place(224, 144, 192, 192);
  const cv::Mat paler = 0.6 * test::textured_picture(place.width, place.height, 7) + 50;
  paler.copyTo(frame(place));
  DetectOptions options;
  options.max_features = 400;
  const auto extractor = FeatureExtractor::create(frame.cols, frame.rows, options);
  extractor->set_frame(test::gray(frame));
  const auto features = extractor->features();
  EXPECT_EQ(features.size(), 400u);
  const auto inside = std::count_if(features.begin(), features.end(), [&](const TrackerFeature& f) {
    return place.contains(cv::Point(static_cast<int>(f.x), static_cast<int>(f.y)));
  });
  EXPECT_GT(inside, 0.25 * 400 * place.area() / frame.size().area());
}

// By brute force over the cells: what comes late is weaker than all that a cell had before, and
// only where that cell was full.
TEST(TrackerFeatures, SpareOnesAreTheNextStrongestOfFullCells) {
  cv::Mat frame(480, 640, CV_8UC1);
  cv::RNG noise(5);
  noise.fill(frame, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(frame, frame, {}, 1.2);
  DetectOptions options;
  options.threshold = 6;
  const auto extractor = FeatureExtractor::create(frame.cols, frame.rows, options);
  extractor->set_frame(test::gray(frame));
  const std::size_t count = extractor->features().size();
  const auto slice = [&] {
    std::int64_t work = 1;
    return extractor->extend_spare(work);
  };
  while (!slice()) continue;
  const auto all = extractor->found();
  ASSERT_GT(all.size(), count + 500);
  EXPECT_LE(all.size(), count + 1500);
  struct Cell {
    int kept = 0;
    int weakest = 255;
    int spare = 0;
    int strongest = 0;
  };
  std::map<std::array<int, 3>, Cell> cells;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const float scale = static_cast<float>(1 << all[i].level);
    Cell& cell = cells[{all[i].level, static_cast<int>((all[i].x + 0.5f) / scale) / options.cell,
                        static_cast<int>((all[i].y + 0.5f) / scale) / options.cell}];
    ++(i < count ? cell.kept : cell.spare);
    if (i < count) cell.weakest = std::min(cell.weakest, int{all[i].score});
    if (i >= count) cell.strongest = std::max(cell.strongest, int{all[i].score});
  }
  for (const auto& [at, cell] : cells) {
    if (cell.spare == 0) continue;
    EXPECT_EQ(cell.kept, options.per_cell) << at[0] << ' ' << at[1] << ' ' << at[2];
    EXPECT_LE(cell.spare, options.per_cell);
    EXPECT_LE(cell.strongest, cell.weakest) << at[0] << ' ' << at[1] << ' ' << at[2];
  }
}

/// The number of single frames in which the picture is found; each within two pixels of its
/// place.
int found_in_frames(const PoseLoopOptions& options, const SceneBand& band, int frames) {
  const Camera camera = default_camera(640, 480);
  const auto bytes = bundle_with({record()});
  const auto loop = PoseLoop::create(BundleView::open(bytes).value(), camera, options);
  EXPECT_TRUE(loop) << to_line(loop.error());
  if (!loop) return 0;
  Random random(4);
  int found = 0;
  for (int i = 0; i < frames; ++i) {
    const Pose pose = draw_pose(band, test::gray(picture()), camera, random);
    const SceneFrame scene =
        render_scene(test::gray(picture()), camera, pose,
                     clutter(640, 480, static_cast<std::uint32_t>(100 + i)), band, random);
    const auto result = (*loop)->step(scene.picture.view());
    EXPECT_TRUE(result);
    if (!result || result->visible.empty()) continue;
    ++found;
    EXPECT_LT(worst_corner(result->visible[0], scene), 2.0) << i;
    EXPECT_NEAR(result->visible[0].pose.translation.z, pose.translation.z,
                0.02 * pose.translation.z);
  }
  return found;
}

// A cell of the frame shows most of a small pattern, but has room for a dozen features.
TEST(PoseLoop, FindsSmallPatternsByTheSpareFeatures) {
  SceneBand band;
  band.area_low = 0.015 * 640 * 480 / (picture().cols * picture().rows);
  band.area_high = 2.5 * band.area_low;
  PoseLoopOptions options;
  options.track = false;
  options.detect.per_cell = 5;  // the picture has few corners
  const int with_them = found_in_frames(options, band, 12);
  options.detect.max_spare = 0;
  const int without = found_in_frames(options, band, 12);
  EXPECT_GT(with_them, without + 1);
}

// Codes of steep views match worse than others do by chance: a vote of the nearest alone finds 11.
TEST(PoseLoop, FindsSteepPatternsByTheVotesOfAllMatches) {
  SceneBand band;
  band.area_low = 0.12;
  band.area_high = 0.3;
  band.tilt_low = 70;
  band.tilt_high = 76;
  PoseLoopOptions options;
  options.track = false;

  EXPECT_GE(found_in_frames(options, band, 40), 18);
}

TEST(PoseLoop, FindsThePatternWhereItIs) {
  PoseLoopOptions options;
  options.track = false;
  SceneBand band;
  band.area_low = 0.5;
  band.area_high = 2.0;
  band.tilt_high = 45;
  constexpr int kFrames = 10;
  EXPECT_GE(found_in_frames(options, band, kFrames), kFrames - 1);
}

// Features in a corner leave the other corners uncertain by many pixels: the patches must take the
// pose up from there, though half of them is hidden.
TEST(PoseLoop, GrowsAPoseFromTheFeaturesOfOneCorner) {
  const Camera camera = default_camera(640, 480);
  tracker::PatternPyramid coarser;
  const auto pattern = tracker::view_tracked_pattern(record(), 0, coarser);
  ASSERT_TRUE(pattern) << to_line(pattern.error());
  SceneBand band;
  band.area_low = 0.8;
  band.area_high = 1.2;
  band.covered_low = band.covered_high = 0.5;
  const auto extractor = FeatureExtractor::create(camera.width, camera.height, {});
  tracker::PatchCache patches;
  Random random(6);
  int grown_from_far = 0;
  for (int i = 0; i < 12; ++i) {
    const Pose pose = draw_pose(band, test::gray(picture()), camera, random);
    const SceneFrame scene =
        render_scene(test::gray(picture()), camera, pose,
                     clutter(640, 480, static_cast<std::uint32_t>(300 + i)), band, random);
    extractor->set_frame(scene.picture.view());
    std::vector<glm::dvec3> world;
    std::vector<glm::dvec2> seen;
    for (int k = 0; k < 12; ++k) {
      world.emplace_back(random.uniform(-0.8, 0.0), random.uniform(-0.6, 0.0), 0.0);
      seen.push_back(project(camera, pose.rotation * world.back() + pose.translation) +
                     1.5 * glm::dvec2(random.normal(), random.normal()));
    }
    const std::vector<double> sigma(world.size(), 1.5);
    const Pose start = refine_pose(camera, world, seen, pose);
    Pose grown = start;
    tracker::refine_from_inliers(*pattern,
                                 {camera, extractor->pyramid(), tracker::kernels(), patches},
                                 {world, seen, sigma}, grown);
    const auto error = [&](const Pose& at) {
      Detection detection;
      EXPECT_TRUE(tracker::map_corners(*pattern, tracker::map_of_pose(*pattern, camera, at),
                                       detection.corners));
      return worst_corner(detection, scene);
    };
    grown_from_far += error(start) > 10.0 && error(grown) < 2.0 ? 1 : 0;
    EXPECT_LT(error(grown), std::max(2.0, error(start))) << i;
  }
  EXPECT_GE(grown_from_far, 4);
}

TEST(PoseLoop, TracksAPathAndTellsWhenThePatternIsGone) {
  const Camera camera = default_camera(640, 480);
  const auto bytes = bundle_with({record()});
  auto loop = PoseLoop::create(BundleView::open(bytes).value(), camera);
  ASSERT_TRUE(loop);
  SceneBand band;
  Random random(5);
  const GrayPicture background = clutter(640, 480, 77);
  TrackResult result;
  std::vector<double> errors;
  const auto pose_at = [](int i) {
    return pose_of(look_at(2.6 + 0.02 * i, 10 + 0.5 * i, 20, 3.0 * i, 0.02 * i, -0.01 * i));
  };
  for (int i = 0; i < 20; ++i) {
    const SceneFrame scene =
        render_scene(test::gray(picture()), camera, pose_at(i), background, band, random);
    ASSERT_TRUE((*loop)->step(scene.picture.view(), result));
    ASSERT_EQ(result.visible.size(), 1u) << i << " " << to_string(result.reason);
    errors.push_back(worst_corner(result.visible[0], scene));
    EXPECT_LT(errors.back(), 1.0) << i;
    // Once it is held, nothing searches for it.
    if (i > 0) {
      EXPECT_EQ(result.features, 0);
    }
  }
  // Patches that all weigh alike are off by 0.05, templates sharper than what a lens shows by more.
  std::nth_element(errors.begin(), errors.begin() + 10, errors.end());
  EXPECT_LT(errors[10], 0.04);
  ASSERT_TRUE((*loop)->step(background.view(), result));
  EXPECT_TRUE(result.visible.empty());
  EXPECT_NE(result.reason, Reason::kVisible);
  const GrayPicture blank = plain(640, 480, 120);
  (*loop)->reset();
  ASSERT_TRUE((*loop)->step(blank.view(), result));
  EXPECT_EQ(result.reason, Reason::kNoFeatures);
}

TEST(PoseLoop, NeverSeesThePatternInClutter) {
  const Camera camera = default_camera(640, 480);
  const auto bytes = bundle_with({record()});
  auto loop = PoseLoop::create(BundleView::open(bytes).value(), camera);
  ASSERT_TRUE(loop);
  for (std::uint32_t i = 0; i < 12; ++i) {
    const GrayPicture frame = clutter(640, 480, 1000 + i);
    const auto result = (*loop)->step(frame.view());
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->visible.empty()) << i;
  }
}

TEST(PoseLoop, FramesOfAnySizeStrideAndContentDoNoHarm) {
  const auto bytes = bundle_with({record()});
  cv::RNG random(6);
  for (const cv::Size& size :
       {cv::Size(1, 1), {5, 300}, {300, 5}, {36, 36}, {37, 37}, {63, 41}, {129, 97}}) {
    auto loop =
        PoseLoop::create(BundleView::open(bytes).value(), default_camera(size.width, size.height));
    ASSERT_TRUE(loop);
    const int stride = size.width + random.uniform(0, 9);
    // Exactly as many bytes as a frame has: the sanitizer watches the ends.
    std::vector<std::uint8_t> pixels(
        static_cast<std::size_t>(stride * (size.height - 1) + size.width));
    for (std::uint8_t& gray : pixels) gray = static_cast<std::uint8_t>(random.uniform(0, 256));
    EXPECT_TRUE((*loop)->step({pixels.data(), size.width, size.height, stride}));
    const GrayPicture flat = plain(size.width, size.height, 0);
    EXPECT_TRUE((*loop)->step(flat.view()));
    EXPECT_FALSE((*loop)->step({pixels.data(), size.width + 1, size.height, stride + 1}));
  }
}

TEST(PoseLoop, BakesTheSameBytesTwice) {
  TrackerRecordOptions options;
  options.features = 200;
  options.trial_views = 8;
  const cv::Mat small = textured_picture(120, 96, 31);
  const auto first = make_tracker_record(test::gray(small), options);
  const auto second = make_tracker_record(test::gray(small), options);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(*first, *second);
}

TEST(PoseLoop, ABundleWithoutRecordsIsAnError) {
  BundleContent content;
  const auto bytes = test::bundle_bytes(content);
  const auto loop = PoseLoop::create(BundleView::open(bytes).value(), default_camera(640, 480));
  ASSERT_FALSE(loop);
  EXPECT_EQ(loop.error().code, "tracker.no-patterns");
}

TEST(PoseLoop, RecordsCutShortOrOfAnotherVersionAreRefused) {
  const Camera camera = default_camera(64, 64);
  for (std::size_t size = 0; size < record().size(); size += size < 200 ? 1 : 4093) {
    auto section = record();
    section.resize(size);
    const auto bytes = bundle_with({section});
    EXPECT_FALSE(PoseLoop::create(BundleView::open(bytes).value(), camera)) << size;
  }
  auto other = record();
  other[0] = std::byte{99};
  const auto bytes = bundle_with({other});
  const auto loop = PoseLoop::create(BundleView::open(bytes).value(), camera);
  ASSERT_FALSE(loop);
  EXPECT_EQ(loop.error().code, "tracker.record-version");
}

// Whatever a damaged record says: it is refused, or the loop runs without touching memory of
// others.
TEST(PoseLoop, DamagedRecordsDoNoHarm) {
  const Camera camera = default_camera(320, 240);
  SceneBand band;
  Random random(8);
  const Pose pose = draw_pose(band, test::gray(picture()), camera, random);
  const SceneFrame scene =
      render_scene(test::gray(picture()), camera, pose, clutter(320, 240, 3), band, random);
  cv::RNG damage(9);
  TrackerRecordHeader header{};
  std::memcpy(&header, record().data(), sizeof header);
  for (int i = 0; i < 60; ++i) {
    auto section = record();
    const bool tables = i % 2 == 0;
    const int last = tables ? static_cast<int>(header.pixels_offset) : 64;
    for (int k = 0; k < (tables ? 200 : 2); ++k) {
      const int at = damage.uniform(4, last);
      section[static_cast<std::size_t>(at)] = static_cast<std::byte>(damage.uniform(0, 256));
    }
    const auto bytes = bundle_with({section});
    auto loop = PoseLoop::create(BundleView::open(bytes).value(), camera);
    if (!loop) continue;
    EXPECT_TRUE((*loop)->step(scene.picture.view()));
    EXPECT_TRUE((*loop)->step(scene.picture.view()));
  }
}

}  // namespace
}  // namespace modar
