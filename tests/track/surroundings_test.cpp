// The pose of a pattern that is not seen, followed from its surroundings: rooms of textured planes,
// drawn by OpenCV from known poses.
#include <gtest/gtest.h>

#include <cmath>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "modar/pose_loop.hpp"
#include "tests/formats/allocation_counter.hpp"
#include "tests/track/pose_loop_samples.hpp"

namespace modar {
namespace {

using namespace test;

const Camera& camera() {
  static const Camera kCamera = default_camera(320, 240);
  return kCamera;
}

/// A picture in the pattern's world: where its middle is, half its sides, how it is turned about
/// the vertical.
struct Poster {
  cv::Mat picture;
  cv::Vec3d middle;
  double half_width;
  double half_height;
  double turn_deg = 0;
};

const std::vector<Poster>& room() {
  static const std::vector<Poster> kRoom = {
      {textured_picture(950, 640, 5), {3.2, 0, -0.7}, 6.5, 4.3},
      {textured_picture(240, 240, 6), {5, 0.3, 0.5}, 1.2, 1.2, -45},
      {textured_picture(160, 160, 7), {-2, 1, 0.4}, 0.8, 0.8, 20},
      {textured_picture(160, 160, 8), {2.1, -1, 0.9}, 0.7, 0.7, -15}};
  return kRoom;
}

void draw(const Poster& poster, const View& view, cv::Mat& frame) {
  const double angle = poster.turn_deg * CV_PI / 180;
  const cv::Vec3d right = poster.half_width * cv::Vec3d(std::cos(angle), 0, -std::sin(angle));
  const cv::Vec3d up(0, poster.half_height, 0);
  const cv::Vec3d corner = view.rotation * (poster.middle - right + up) + view.translation;
  const cv::Vec3d u = view.rotation * right * (2.0 / poster.picture.cols);
  const cv::Vec3d v = view.rotation * up * (-2.0 / poster.picture.rows);
  const cv::Matx33d plane(u[0], v[0], corner[0], u[1], v[1], corner[1], u[2], v[2], corner[2]);
  // Pixel centres of the picture are half a pixel from its edge.
  const cv::Matx33d centred(1, 0, 0.5, 0, 1, 0.5, 0, 0, 1);
  const cv::Matx33d map = cv::Matx33d(camera_matrix(camera())) * plane * centred;
  cv::Mat drawn;
  cv::Mat mask;
  cv::warpPerspective(poster.picture, drawn, map, frame.size(), cv::INTER_LINEAR);
  cv::warpPerspective(cv::Mat(poster.picture.size(), CV_8UC1, cv::Scalar(255)), mask, map,
                      frame.size(), cv::INTER_NEAREST);
  // The map holds before the camera only: what reaches behind it is left out.
  const cv::Vec3d far = view.rotation * (poster.middle + right) + view.translation;
  const cv::Vec3d near = view.rotation * (poster.middle - right) + view.translation;
  if (std::min(far[2], near[2]) > 0.05) drawn.copyTo(frame, mask);
}

/// Sways before the pattern, turned by `yaw` degrees to the right.
View eye_at(double time_s, double yaw) {
  const cv::Vec3d centre(0.6 * std::sin(1.7 * time_s), 0.25 * std::sin(2.3 * time_s),
                         3.6 + 0.2 * std::sin(time_s));
  cv::Matx33d turn;
  cv::Rodrigues(cv::Vec3d(0, -yaw * CV_PI / 180, 0), turn);
  const cv::Matx33d rotation = turn * cv::Matx33d(1, 0, 0, 0, -1, 0, 0, 0, -1);
  return {rotation, -(rotation * centre)};
}

cv::Mat frame_at(const View& view, const std::vector<Poster>& posters) {
  cv::Mat frame(camera().height, camera().width, CV_8UC1, cv::Scalar(90));
  for (const Poster& poster : posters) draw(poster, view, frame);
  return frame;
}

Poster pattern_at(const cv::Vec3d& middle) {
  return {picture(), middle, 1.0, 1.0 * picture().rows / picture().cols};
}

std::vector<Poster> with_pattern() {
  std::vector<Poster> all = room();
  all.push_back(pattern_at({0, 0, 0}));
  return all;
}

/// Over the pattern: something plain.
void cover(cv::Mat& frame, const View& view) {
  Poster hand = pattern_at({0, 0, 0.05});
  hand.picture = cv::Mat(60, 60, CV_8UC1, cv::Scalar(150));
  hand.half_width = hand.half_height = 1.1;
  draw(hand, view, frame);
}

class SurroundingsTest : public testing::Test {
 protected:
  SurroundingsTest() {
    PoseLoopOptions how;
    how.extended = true;
    loop_ = PoseLoop::create(BundleView::open(bundle_).value(), camera(), how).value();
  }

  /// The pattern in the frame, null if nothing is reported.
  const Detection* step(const cv::Mat& frame) {
    EXPECT_TRUE(loop_->step(gray(frame), result_));
    return result_.visible.empty() ? nullptr : &result_.visible[0];
  }
  /// Frames that show the pattern from a swaying camera.
  void learn(int frames) {
    for (int i = 0; i < frames; ++i) {
      const Detection* seen = step(frame_at(eye_at(time_ += 1.0 / 30, 0), with_pattern()));
      ASSERT_NE(seen, nullptr);
      EXPECT_FALSE(seen->extended);
    }
  }

  std::vector<std::byte> bundle_ = bundle_with({record()});
  std::unique_ptr<PoseLoop> loop_;
  TrackResult result_;
  double time_ = 0;
};

double position_error(const Detection& seen, const View& view) {
  const Pose truth = pose_of(view);
  return glm::length(seen.pose.translation - truth.translation) / glm::length(truth.translation);
}

double rotation_error(const Detection& seen, const View& view) {
  const Pose truth = pose_of(view);
  return glm::length(rotation_vector(seen.pose.rotation * glm::transpose(truth.rotation))) * 180 /
         CV_PI;
}

TEST_F(SurroundingsTest, FollowsWhileThePatternIsOutOfView) {
  learn(30);
  int extended = 0;
  double jump = 0;
  std::array<glm::dvec2, 4> before{};
  std::array<glm::dvec2, 4> truth_before{};
  for (int i = 0; i < 60; ++i) {
    const double yaw = 45 * std::sin(CV_PI * std::min(i / 50.0, 1.0));
    const View view = eye_at(time_ += 1.0 / 30, yaw);
    const Detection* seen = step(frame_at(view, with_pattern()));
    ASSERT_NE(seen, nullptr) << i;
    EXPECT_LT(position_error(*seen, view), 0.03) << i;
    EXPECT_LT(rotation_error(*seen, view), 1.0) << i;
    extended += seen->extended ? 1 : 0;
    std::array<glm::dvec2, 4> truth{};
    const auto corners = true_corners(picture(), view, camera());
    for (std::size_t k = 0; k < 4; ++k) {
      truth[k] = {corners[k].x, corners[k].y};
      if (i < 40) continue;
      jump = std::max(jump, glm::length(seen->corners[k] - before[k] - truth[k] + truth_before[k]));
    }
    before = seen->corners;
    truth_before = truth;
  }
  EXPECT_GE(extended, 20);
  EXPECT_LT(jump, 5);
  EXPECT_FALSE(result_.visible[0].extended);
}

TEST_F(SurroundingsTest, FollowsWhileThePatternIsCovered) {
  learn(30);
  for (int i = 0; i < 20; ++i) {
    const View view = eye_at(time_ += 1.0 / 30, 0);
    cv::Mat frame = frame_at(view, with_pattern());
    cover(frame, view);
    const Detection* seen = step(frame);
    ASSERT_NE(seen, nullptr) << i;
    EXPECT_TRUE(seen->extended);
    EXPECT_LT(position_error(*seen, view), 0.01) << i;
    EXPECT_GT(seen->position_sigma, 0);
    EXPECT_LT(seen->position_sigma, 0.1);
  }
  loop_->reset();
  const View view = eye_at(time_, 0);
  cv::Mat frame = frame_at(view, with_pattern());
  cover(frame, view);
  EXPECT_EQ(step(frame), nullptr) << "forgotten by a reset";
}

// What covers the pattern for a while has points of its own, and goes away with them.
TEST_F(SurroundingsTest, DoesNotGoWithWhatCoveredThePattern) {
  learn(40);
  Poster hand = pattern_at({0, 0, 0.3});
  hand.picture = textured_picture(300, 220, 9);
  hand.half_width = 1.1;
  hand.half_height = 0.8;
  for (int i = 0; i < 45; ++i) {
    const View view = eye_at(time_ += 1.0 / 30, 0);
    const int gone = std::max(0, i - 37);
    hand.middle[0] = 0.02 * gone * gone;
    std::vector<Poster> posters = with_pattern();
    posters.push_back(hand);
    const Detection* seen = step(frame_at(view, posters));
    ASSERT_NE(seen, nullptr) << i;
    EXPECT_LT(rotation_error(*seen, view), 1.2) << i;
    EXPECT_LT(position_error(*seen, view), 0.01) << i;
  }
}

// The rest of a pattern that is covered says its pose, as it does without surroundings.
TEST_F(SurroundingsTest, LeavesTheFrameTheLastWord) {
  const auto plain = PoseLoop::create(BundleView::open(bundle_).value(), camera()).value();
  const auto same = [&](const cv::Mat& frame, int i) {
    const Detection* seen = step(frame);
    TrackResult result;
    EXPECT_TRUE(plain->step(gray(frame), result));
    if (result.visible.empty()) return false;
    EXPECT_NE(seen, nullptr) << i;
    if (seen == nullptr) return true;
    EXPECT_FALSE(seen->extended) << i;
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(seen->corners[k], result.visible[0].corners[k]) << i;
    }
    return true;
  };
  int shown = 0;
  for (int i = 0; i < 90; ++i) {
    const View view = eye_at(time_ += 1.0 / 30, 0);
    Poster hand = pattern_at({2.0 - 1.3 * std::sin(CV_PI * std::max(0, i - 30) / 60), 0, 0.1});
    hand.picture = cv::Mat(60, 60, CV_8UC1, cv::Scalar(150));
    std::vector<Poster> posters = with_pattern();
    if (i >= 30) posters.push_back(hand);
    shown += same(frame_at(view, posters), i) ? 1 : 0;
  }
  EXPECT_GE(shown, 85);
}

// A jerk moves the frame further than patches are looked for; a gyroscope tells it.
TEST_F(SurroundingsTest, FollowsAJerkByAGyroscope) {
  for (const bool gyroscope : {false, true}) {
    loop_->reset();
    time_ = 0;
    learn(30);
    double before = 0;
    int followed = 0;
    for (const double yaw : {0.0, 0.0, 11.0, 11.0, 11.0}) {
      const View view = eye_at(time_ += 1.0 / 30, yaw);
      cv::Mat frame = frame_at(view, with_pattern());
      cover(frame, view);
      // The camera turns to the right: about its axis that points down.
      if (gyroscope) loop_->set_turn({0, (yaw - before) * CV_PI / 180, 0});
      before = yaw;
      const Detection* seen = step(frame);
      followed += seen != nullptr && rotation_error(*seen, view) < 1.0 ? 1 : 0;
    }
    EXPECT_EQ(followed, gyroscope ? 5 : 2);
  }
}

// A still camera sees the pattern carried about: its surroundings say nothing of it.
TEST_F(SurroundingsTest, SaysNothingOfAPatternThatIsCarried) {
  const View view = eye_at(0, 0);
  const auto carried = [](int i) {
    return cv::Vec3d(0.5 * std::sin(0.09 * i), 0.2 * std::sin(0.13 * i), 0.2);
  };
  std::vector<Poster> posters = room();
  posters.push_back(pattern_at({0, 0, 0}));
  for (int i = 0; i < 50; ++i) {
    posters.back() = pattern_at(carried(i));
    const Detection* seen = step(frame_at(view, posters));
    ASSERT_NE(seen, nullptr);
  }
  posters.pop_back();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(step(frame_at(view, posters)), nullptr) << i;
}

// Without motion nothing has a depth.
TEST_F(SurroundingsTest, NeedsAMovingCamera) {
  const View view = eye_at(0, 0);
  cv::Mat frame = frame_at(view, with_pattern());
  for (int i = 0; i < 30; ++i) ASSERT_NE(step(frame), nullptr);
  cover(frame, view);
  EXPECT_EQ(step(frame), nullptr);
}

TEST_F(SurroundingsTest, AllocatesNothingPerFrame) {
  learn(15);
  const View view = eye_at(time_, 0);
  cv::Mat covered = frame_at(view, with_pattern());
  const cv::Mat seen = covered.clone();
  cover(covered, view);
  std::size_t before = 0;
  for (int round = 0; round < 2; ++round) {
    if (round == 1) before = allocation_count();
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(loop_->step(gray(covered), result_));
      ASSERT_TRUE(loop_->step(gray(seen), result_));
    }
  }
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace
}  // namespace modar
