// The smoothing of poses against what its header promises.
#include "modar/pose_smoother.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

namespace modar {
namespace {

constexpr double kFrame_s = 1.0 / 30.0;

std::vector<Detection> at(double x, double angle = 0.0) {
  Detection detection;
  detection.pose.translation = {x, 0.0, 4.0};
  detection.pose.rotation = rotation_matrix({0.0, angle, 0.0});
  return {detection};
}

TEST(PoseSmoother, OffItChangesNothing) {
  PoseSmoother smoother(1, 0.0);
  for (int i = 0; i < 5; ++i) {
    auto seen = at(0.3 * i * i);
    EXPECT_EQ(smoother.step(i * kFrame_s, seen), 0.0);
    EXPECT_EQ(seen[0].pose.translation.x, 0.3 * i * i);
  }
}

TEST(PoseSmoother, ARestingModelTremblesLess) {
  PoseSmoother smoother(1, 100.0);
  double raw = 0;
  double smooth = 0;
  for (int i = 0; i < 300; ++i) {
    const double noise = 2e-4 * std::sin(12.9898 * i * i);
    auto seen = at(noise, noise);
    const double latency = smoother.step(i * kFrame_s, seen);
    EXPECT_LE(latency, 100.0);
    if (i < 30) continue;
    raw += noise * noise;
    smooth += seen[0].pose.translation.x * seen[0].pose.translation.x;
  }
  EXPECT_LT(std::sqrt(smooth / raw), 0.5);
}

// On a ramp, a filter of first order trails by its time constant.
TEST(PoseSmoother, ASteadyMotionIsTrailedByTheStatedLatency) {
  for (const double speed : {0.02, 0.2, 2.0}) {
    PoseSmoother smoother(1, 120.0);
    double latency = 0;
    double lag = 0;
    for (int i = 0; i < 200; ++i) {
      const double x = speed * i * kFrame_s;
      auto seen = at(x);
      latency = smoother.step(i * kFrame_s, seen);
      lag = x - seen[0].pose.translation.x;
    }
    EXPECT_NEAR(lag, speed * latency * 1e-3, 0.03 * speed * latency * 1e-3) << speed;
    EXPECT_LT(latency, 120.0);
  }
}

TEST(PoseSmoother, CornersStayWhereTheSmoothedPoseHasThem) {
  // Of a camera of 600 pixels, 4 units away: a corner moves by 150 pixels a unit.
  PoseSmoother smoother(1, 120.0);
  for (int i = 0; i < 40; ++i) {
    const double x = 0.02 * i + 0.01 * std::sin(40.0 * i);
    auto seen = at(x);
    for (std::size_t k = 0; k < 4; ++k) {
      seen[0].corners[k] = {300.0 + 100.0 * static_cast<double>(k) + 150.0 * x, 200.0};
    }
    smoother.step(i * kFrame_s, seen);
    for (std::size_t k = 0; k < 4; ++k) {
      const double there = 300.0 + 100.0 * static_cast<double>(k);
      EXPECT_NEAR(seen[0].corners[k].x, there + 150.0 * seen[0].pose.translation.x, 1e-9) << i;
    }
    if (i > 0) {
      EXPECT_GT(std::abs(seen[0].pose.translation.x - x), 1e-6);
    }
  }
}

TEST(PoseSmoother, TurnsAreSmoothedAndStayTurns) {
  PoseSmoother smoother(1, 200.0);
  auto seen = at(0.0, 0.0);
  smoother.step(0.0, seen);
  seen = at(0.0, 0.1);
  smoother.step(kFrame_s, seen);
  const double turned = glm::length(rotation_vector(seen[0].pose.rotation));
  EXPECT_GT(turned, 0.0);
  EXPECT_LT(turned, 0.1);
  EXPECT_NEAR(glm::length(seen[0].pose.rotation[0]), 1.0, 1e-12);
}

TEST(PoseSmoother, WhatComesBackStartsAnew) {
  PoseSmoother smoother(2, 500.0);
  auto seen = at(0.0);
  smoother.step(0.0, seen);
  smoother.step(kFrame_s, {});
  seen = at(1.0);
  EXPECT_EQ(smoother.step(2 * kFrame_s, seen), 0.0);
  EXPECT_EQ(seen[0].pose.translation.x, 1.0);
}

}  // namespace
}  // namespace modar
