// What the loop says from frame to frame: every reason for not being visible, several patterns at
// once, coming back, the search on a thread of its own, and the same bits at every SIMD level.
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "modar/pose_loop.hpp"
#include "runtime/track/reason_evidence.hpp"
#include "tests/track/pose_loop_samples.hpp"

namespace modar {
namespace {

using namespace test;  // the samples

std::unique_ptr<PoseLoop> loop_of(const std::vector<std::byte>& bundle,
                                  const PoseLoopOptions& options = {},
                                  const Camera& camera = default_camera(kWidth, kHeight)) {
  auto loop = PoseLoop::create(BundleView::open(bundle).value(), camera, options);
  EXPECT_TRUE(loop) << to_line(loop.error());
  return std::move(*loop);
}

const std::vector<std::byte>& one_pattern() {
  static const std::vector<std::byte> kBundle = bundle_with({record()});
  return kBundle;
}

const GrayPicture& background() {
  static const GrayPicture kBackground = clutter(kWidth, kHeight, 77);
  return kBackground;
}

View near_view() {
  return look_at(2.6, 15, 20, 10);
}

Reason reason_for(PoseLoop& loop, const GrayPicture& picture) {
  TrackResult result;
  EXPECT_TRUE(loop.step(picture.view(), result));
  return result.reason;
}

TEST(TrackerReason, FollowsFromTheEvidence) {
  using tracker::reason_of;
  tracker::ReasonEvidence sharp;
  sharp.edge = 50;
  sharp.coarse_edge = 90;
  EXPECT_EQ(reason_of(Reason::kNoGeometry, sharp), Reason::kNoGeometry);
  const auto with = [&](auto&& change) {
    tracker::ReasonEvidence evidence = sharp;
    change(evidence);
    return evidence;
  };
  const auto dark = with([](auto& e) { e.brightness = 8; });
  EXPECT_EQ(reason_of(Reason::kNoGeometry, dark), Reason::kTooDark);
  EXPECT_EQ(reason_of(Reason::kCurved, dark), Reason::kCurved) << "it was seen well enough";
  const auto bright = with([](auto& e) { e.saturated = 0.9; });
  EXPECT_EQ(reason_of(Reason::kFewMatches, bright), Reason::kOverexposed);
  const auto soft = with([](auto& e) { e.edge = 15; });
  EXPECT_EQ(reason_of(Reason::kNoGeometry, soft), Reason::kBlurred);
  const auto plain_wall = with([](auto& e) { e.edge = e.coarse_edge = 2; });
  EXPECT_EQ(reason_of(Reason::kFewMatches, plain_wall), Reason::kFewMatches);
  const auto place = [&](int votes, double side, double inside, double glare) {
    return with([&](auto& e) {
      e.votes = votes;
      e.side = side;
      e.inside = inside;
      e.glare = glare;
    });
  };
  constexpr int kSeen = tracker::LikelyPlace::kSeen;
  EXPECT_EQ(reason_of(Reason::kFailedVerification, place(20, 0.4, 1, 0.5)), Reason::kGlare);
  EXPECT_EQ(reason_of(Reason::kNoGeometry, place(20, 0.4, 0.3, 0)), Reason::kAtTheEdge);
  EXPECT_EQ(reason_of(Reason::kNoGeometry, place(20, 1.4, 0.3, 0)), Reason::kNoGeometry);
  EXPECT_EQ(reason_of(Reason::kNoGeometry, place(3, 0.4, 0.3, 0)), Reason::kNoGeometry);
  EXPECT_EQ(reason_of(Reason::kNoGeometry, place(kSeen, 0.1, 1, 0)), Reason::kTooSmall);
  EXPECT_EQ(reason_of(Reason::kNoGeometry, place(20, 0.1, 1, 0)), Reason::kNoGeometry);
  EXPECT_EQ(reason_of(Reason::kNoGeometry, place(kSeen, 0.4, 0, 0)), Reason::kOutOfView);
  EXPECT_EQ(reason_of(Reason::kFailedVerification, place(kSeen, 0.4, 0, 0)), Reason::kAtTheEdge);
  EXPECT_EQ(reason_of(Reason::kNoGeometry, place(7, 0.4, 1, 0.2)), Reason::kNoGeometry);
  EXPECT_EQ(reason_of(Reason::kNoGeometry, place(8, 0.4, 1, 0.2)), Reason::kGlare);
  auto softer = place(kSeen, 0.4, 1, 0);
  softer.edge = 40;  // corrected for noise 0.44 of the coarse ones
  EXPECT_EQ(reason_of(Reason::kNoGeometry, softer), Reason::kLostByBlur);
  softer.edge = 44;
  EXPECT_EQ(reason_of(Reason::kNoGeometry, softer), Reason::kNoGeometry);
  softer = place(20, 0.4, 1, 0.5);
  softer.edge = 15;
  EXPECT_EQ(reason_of(Reason::kFailedVerification, softer), Reason::kGlare) << "it softens edges";
}

TEST(TrackerRecord, CoarserLevelsAreMeansOfFourPixels) {
  tracker::PatternPyramid coarser;
  const auto pattern = tracker::view_tracked_pattern(record(), 0, coarser);
  ASSERT_TRUE(pattern);
  const auto levels = pattern->pyramid();
  ASSERT_GE(levels.size(), 3u);
  for (std::size_t i = 1; i < levels.size(); ++i) {
    const GrayImage& fine = levels[i - 1];
    const GrayImage& coarse = levels[i];
    ASSERT_EQ(std::pair(coarse.width, coarse.height), std::pair(fine.width / 2, fine.height / 2));
    for (int y = 0; y < coarse.height; ++y) {
      for (int x = 0; x < coarse.width; ++x) {
        const std::uint8_t* four = fine.pixels + 2 * y * fine.stride + 2 * x;
        const int sum = four[0] + four[1] + four[fine.stride] + four[fine.stride + 1];
        ASSERT_EQ(coarse.pixels[y * coarse.stride + x], (sum + 2) / 4) << i;
      }
    }
  }
}

TEST(TrackerReason, FeaturesOfASmallPrintAgreeOverManyFrames) {
  tracker::TrackedPattern pattern;
  pattern.image.width = 400;
  pattern.image.height = 300;
  // A tenth of its size, 30 x 40 pixels from (200, 100) on; one feature a frame, of six.
  const auto vote = [](int which, glm::dvec2 corner) {
    tracker::FeatureMatch match;
    match.pattern = {60.0 * which + 20, 30.0 * which + 20};
    match.affine = glm::dmat2(0.1);
    match.ideal = corner + 0.1 * match.pattern;
    return match;
  };
  const auto found = [&](auto&& corner_of, int votes, int features) {
    tracker::SmallVotes small;
    for (int i = 0; i < votes; ++i) {
      const tracker::FeatureMatch match = vote(i % features, corner_of(i));
      small.add(pattern, std::span(&match, 1));
    }
    tracker::LikelyPlace place;
    small.find(pattern, place);
    return place;
  };
  const auto here = [](int i) { return glm::dvec2(200 + i % 3, 100); };
  const tracker::LikelyPlace place = found(here, 24, 6);
  EXPECT_EQ(place.votes, tracker::LikelyPlace::kSeen);
  EXPECT_NEAR(place.corner.x, 201, 1);
  EXPECT_NEAR(place.right.x, 40, 1e-9);
  EXPECT_EQ(found(here, 12, 6).votes, 0) << "by chance";
  EXPECT_EQ(found(here, 24, 3).votes, 0) << "few of its parts";
  const auto anywhere = [](int i) { return glm::dvec2(60 * (i % 10), 150 * (i % 3)); };
  EXPECT_EQ(found(anywhere, 24, 6).votes, 0);
}

TEST(TrackerReason, NoFeatures) {
  EXPECT_EQ(reason_for(*loop_of(one_pattern()), plain(kWidth, kHeight, 120)), Reason::kNoFeatures);
}

TEST(TrackerReason, FewMatches) {
  // A single bright spot is a corner, but tells nothing.
  GrayPicture spot = plain(kWidth, kHeight, 40);
  for (int y = 200; y < 203; ++y) {
    for (int x = 300; x < 303; ++x) spot.pixels[static_cast<std::size_t>(y * kWidth + x)] = 220;
  }
  EXPECT_EQ(reason_for(*loop_of(one_pattern()), spot), Reason::kFewMatches);
}

TEST(TrackerReason, NoGeometry) {
  int seen = 0;
  for (std::uint32_t seed = 200; seed < 210; ++seed) {
    const Reason reason = reason_for(*loop_of(one_pattern()), clutter(kWidth, kHeight, seed));
    EXPECT_NE(reason, Reason::kVisible) << seed;
    seen += reason == Reason::kNoGeometry ? 1 : 0;
  }
  EXPECT_GT(seen, 0);
}

TEST(TrackerReason, FailedVerification) {
  // A mirrored camera image shows the pattern's back: a strip of it is drawn unchanged, so that
  // matches agree, and everything else is not the pattern.
  const SceneFrame scene = frame_of(look_at(2.2, 0, 0, 0), plain(kWidth, kHeight, 90));
  GrayPicture part = scene.picture;
  const double left = scene.corners[0].x;
  const double right = scene.corners[1].x;
  const auto cut = static_cast<int>(left + 0.12 * (right - left));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = cut; x < kWidth; ++x) {
      part.pixels[static_cast<std::size_t>(y * kWidth + x)] =
          background().pixels[static_cast<std::size_t>(y * kWidth + x)];
    }
  }
  EXPECT_EQ(reason_for(*loop_of(one_pattern()), part), Reason::kFailedVerification);
}

TEST(TrackerReason, LostByBlur) {
  auto loop = loop_of(one_pattern());
  ASSERT_EQ(reason_for(*loop, frame_of(near_view(), background()).picture), Reason::kVisible);
  EXPECT_EQ(reason_for(*loop, frame_of(near_view(), background(), {120.0, 0.6}).picture),
            Reason::kLostByBlur);
}

TEST(TrackerReason, OutOfView) {
  auto loop = loop_of(one_pattern());
  // It leaves to the right, a little further in each frame.
  Reason reason = Reason::kNoFeatures;
  bool seen = false;
  for (int i = 0; i < 60 && (reason != Reason::kOutOfView); ++i) {
    const View view = look_at(2.6, 5, 20, 0, 0.06 * i, 0.0);
    reason = reason_for(*loop, frame_of(view, plain(kWidth, kHeight, 120)).picture);
    seen = seen || reason == Reason::kVisible;
  }
  EXPECT_TRUE(seen);
  EXPECT_EQ(reason, Reason::kOutOfView);
}

TEST(PoseLoopStates, ComesBackWithinThreeFramesOfATotalOcclusion) {
  auto loop = loop_of(one_pattern());
  const auto frame_at = [](int i) {
    return frame_of(look_at(2.6 + 0.01 * i, 15, 20, 10 + 0.5 * i), background()).picture;
  };
  ASSERT_EQ(reason_for(*loop, frame_at(0)), Reason::kVisible);
  const GrayPicture hand = clutter(kWidth, kHeight, 5);
  for (int i = 1; i < 12; ++i) EXPECT_NE(reason_for(*loop, hand), Reason::kVisible);
  int frames = 1;
  while (frames <= 3 && reason_for(*loop, frame_at(11 + frames)) != Reason::kVisible) ++frames;
  EXPECT_LE(frames, 3);
}

TEST(PoseLoopStates, TracksSeveralPatternsAtOnce) {
  const cv::Mat other = textured_picture(300, 240, 901);
  const auto bundle = bundle_with({record_of(other), record()});
  auto loop = loop_of(bundle);
  const Camera camera = default_camera(kWidth, kHeight);
  for (int i = 0; i < 8; ++i) {
    SceneFrame scene = frame_of(look_at(3.2, 10, 20, 2.0 * i, -0.9, 0.0), background());
    Random random(3);
    const SceneLight light;
    const SceneFrame both =
        render_scene(gray(other), camera, pose_of(look_at(3.4, 12, 70, -1.0 * i, 1.0, 0.1)),
                     scene.picture, SceneBand{}, random, &light);
    TrackResult result;
    ASSERT_TRUE(loop->step(both.picture.view(), result));
    ASSERT_EQ(result.visible.size(), 2u) << i;
    EXPECT_EQ(result.visible[0].pattern, 0u);
    EXPECT_LT(worst_corner(result.visible[0], both), 1.0) << i;
    EXPECT_EQ(result.visible[1].pattern, 1u);
    EXPECT_LT(worst_corner(result.visible[1], scene), 1.0) << i;
    if (i > 0) {
      EXPECT_EQ(result.features, 0) << "held patterns are not searched for";
    }
  }
}

// Two prints of one series: the left half is the same, and each alone is taken for the other.
TEST(PoseLoopStates, OfTwoPatternsThatClaimOnePlaceTheFrameDecides) {
  cv::Mat sister = textured_picture(300, 240, 555);
  picture()(cv::Rect(0, 0, 165, 240)).copyTo(sister(cv::Rect(0, 0, 165, 240)));
  const auto of_sister = record_of(sister);
  const SceneFrame scene = frame_of(near_view(), background());
  ASSERT_EQ(reason_for(*loop_of(bundle_with({of_sister})), scene.picture), Reason::kVisible)
      << "alone she is recognised, else this test tests nothing";
  for (const bool first : {true, false}) {
    const auto bundle =
        first ? bundle_with({record(), of_sister}) : bundle_with({of_sister, record()});
    auto loop = loop_of(bundle);
    TrackResult result;
    for (int i = 0; i < 12; ++i) {
      ASSERT_TRUE(loop->step(scene.picture.view(), result));
      ASSERT_EQ(result.visible.size(), 1u) << i;
      EXPECT_EQ(result.visible[0].pattern, first ? 0u : 1u);
    }
  }
}

// A camera of a wrong focal length: no pose fits, the plane's own map does, and it is followed.
TEST(PoseLoopStates, APlaneThatNoPoseExplainsIsFollowedByItsMap) {
  Camera wrong = default_camera(kWidth, kHeight);
  wrong.fx = wrong.fy = 3.5 * kWidth;
  auto loop = loop_of(one_pattern(), {}, wrong);
  int followed = 0;
  for (int i = 0; i < 10; ++i) {
    const SceneFrame scene = frame_of(look_at(2.0, 50 + 0.2 * i, 20, 10 + 0.5 * i), background());
    TrackResult result;
    ASSERT_TRUE(loop->step(scene.picture.view(), result));
    ASSERT_EQ(result.visible.size(), 1u) << i << " " << to_string(result.reason);
    EXPECT_LT(worst_corner(result.visible[0], scene), 3.0) << i;
    followed += result.features == 0 ? 1 : 0;
  }
  EXPECT_GE(followed, 8) << "it was searched for again and again";
}

PoseLoopOptions async_search() {
  PoseLoopOptions options;
  options.async_search = true;
  return options;
}

// Steps until a frame shows the pattern or the time is over.
bool shows_in_time(PoseLoop& loop, const GrayPicture& frame, TrackResult& result) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  do {
    EXPECT_TRUE(loop.step(frame.view(), result));
    if (!result.visible.empty()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

TEST(PoseLoopAsync, FindsWithoutMakingTheFrameWait) {
  auto loop = loop_of(one_pattern(), async_search());
  const SceneFrame scene = frame_of(near_view(), background());
  TrackResult result;
  ASSERT_TRUE(loop->step(scene.picture.view(), result));
  // The search has just begun: whatever the machine, the frame that asked for it has no answer.
  EXPECT_TRUE(result.visible.empty());
  EXPECT_EQ(result.features, 0);
  ASSERT_TRUE(shows_in_time(*loop, scene.picture, result));
  EXPECT_LT(worst_corner(result.visible[0], scene), 1.0);
  // From here on it is tracked, by this thread alone.
  ASSERT_TRUE(loop->step(scene.picture.view(), result));
  EXPECT_EQ(result.visible.size(), 1u);
  EXPECT_EQ(result.times.detect, 0.0);
}

TEST(PoseLoopAsync, WhatWasFoundIsBroughtToThePresentFrame) {
  auto loop = loop_of(one_pattern(), async_search());
  TrackResult result;
  bool found = false;
  for (int i = 0; i < 400 && !found; ++i) {
    // The frame moves on while the search looks at an older one.
    const SceneFrame scene =
        frame_of(look_at(2.6, 15, 20, 10 + 0.2 * (i % 20), 0.004 * (i % 20)), background());
    ASSERT_TRUE(loop->step(scene.picture.view(), result));
    found = !result.visible.empty();
    if (found) {
      EXPECT_LT(worst_corner(result.visible[0], scene), 1.0) << i;
    }
  }
  EXPECT_TRUE(found);
}

TEST(PoseLoopAsync, ForgetsWhatItSearchedForBeforeAReset) {
  auto loop = loop_of(one_pattern(), async_search());
  const SceneFrame scene = frame_of(near_view(), background());
  const GrayPicture blank = plain(kWidth, kHeight, 120);
  for (int i = 0; i < 10; ++i) {
    TrackResult result;
    ASSERT_TRUE(loop->step(scene.picture.view(), result));
    loop->reset();
    ASSERT_TRUE(loop->step(blank.view(), result));
    EXPECT_TRUE(result.visible.empty());
  }
}

TEST(PoseLoopAsync, EndsAtAnyMoment) {
  const SceneFrame scene = frame_of(near_view(), background());
  for (int i = 0; i < 20; ++i) {
    auto loop = loop_of(one_pattern(), async_search());
    TrackResult result;
    for (int k = 0; k < i % 3; ++k) ASSERT_TRUE(loop->step(scene.picture.view(), result));
    if (i % 2 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(i));
  }
}

PoseLoopOptions sliced_search(int budget) {
  PoseLoopOptions options;
  options.budget = budget;
  return options;
}

GrayPicture moving_frame(int i) {
  return frame_of(look_at(2.6, 15, 20, 10 + 0.2 * i, 0.004 * i), background()).picture;
}

// Frames until the pattern shows; 20 if it never does.
int frames_to_find(PoseLoop& loop, TrackResult& result) {
  int i = 0;
  do {
    EXPECT_TRUE(loop.step(moving_frame(i).view(), result));
  } while (++i < 20 && result.visible.empty());
  return i;
}

// A find in an older frame is moved to the present one; less budget, more frames.
TEST(PoseLoopSliced, FindsOverSeveralFramesAndTheSameEachTime) {
  TrackResult first;
  TrackResult again;
  const int frames = frames_to_find(*loop_of(one_pattern(), sliced_search(12)), first);
  ASSERT_EQ(first.visible.size(), 1u) << to_string(first.reason);
  EXPECT_GT(frames, 3);
  EXPECT_EQ(frames_to_find(*loop_of(one_pattern(), sliced_search(12)), again), frames);
  ASSERT_EQ(again.visible.size(), 1u);
  EXPECT_EQ(again.visible[0].corners, first.visible[0].corners);
  const SceneFrame present =
      frame_of(look_at(2.6, 15, 20, 10 + 0.2 * (frames - 1), 0.004 * (frames - 1)), background());
  EXPECT_LT(worst_corner(first.visible[0], present), 1.0);
  // A frame to copy, one to search, one to move the find here.
  EXPECT_EQ(frames_to_find(*loop_of(one_pattern(), sliced_search(1000)), again), 3);
}

TEST(PoseLoopSliced, ForgetsWhatItSearchedForBeforeAReset) {
  auto loop = loop_of(one_pattern(), sliced_search(1000));
  TrackResult result;
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(loop->step(moving_frame(i).view(), result));
  loop->reset();
  // The search of before would be moved here now.
  ASSERT_TRUE(loop->step(moving_frame(2).view(), result));
  EXPECT_TRUE(result.visible.empty());
  EXPECT_EQ(result.features, 0);
}

TEST(PoseLoopStates, EverySimdLevelGivesTheSameBits) {
  std::vector<std::vector<TrackResult>> runs;
  for (int level = 0; level < 3; ++level) {
    PoseLoopOptions options;
    options.detect.simd = level;
    auto loop = loop_of(one_pattern(), options);
    auto& run = runs.emplace_back();
    for (int i = 0; i < 4; ++i) {
      const SceneFrame scene = frame_of(look_at(2.6, 15, 20, 10 + 2.0 * i), background());
      ASSERT_TRUE(loop->step(scene.picture.view(), run.emplace_back()));
    }
  }
  for (std::size_t level = 1; level < runs.size(); ++level) {
    for (std::size_t i = 0; i < runs[0].size(); ++i) {
      ASSERT_EQ(runs[level][i].visible.size(), 1u);
      EXPECT_EQ(runs[level][i].features, runs[0][i].features);
      const Detection& a = runs[0][i].visible[0];
      const Detection& b = runs[level][i].visible[0];
      EXPECT_EQ(a.corners, b.corners) << level << " " << i;
      EXPECT_EQ(a.pose.rotation, b.pose.rotation);
      EXPECT_EQ(a.pose.translation, b.pose.translation);
      EXPECT_EQ(a.inliers, b.inliers);
    }
  }
}

}  // namespace
}  // namespace modar
