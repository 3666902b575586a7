// The player's JSON lines, read by another JSON library.
#include "runtime/play/frame_report.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace modar {
namespace {

using nlohmann::json;

FrameReport seen_frame() {
  FrameReport report;
  report.frame = 12;
  report.time_s = 0.4;
  report.reason = Reason::kVisible;
  report.state = Shown::kShown;
  Detection seen;
  seen.pattern = 1;
  seen.corners = {{{0.5, 1.25}, {100, 2}, {101, 99}, {-3, 98}}};
  // A quarter turn about z: x axis to y axis. GLM's constructor takes columns.
  seen.pose.rotation = glm::dmat3({0, 1, 0}, {-1, 0, 0}, {0, 0, 1});
  seen.pose.translation = {0.1, -0.2, 3.0000000000000004};
  seen.matches = 80;
  seen.inliers = 61;
  report.visible = {seen};
  report.at(Stage::kDetect) = 1.23456;
  report.at(Stage::kTrack) = 7;
  return report;
}

TEST(JsonLines, AFrameHoldsWhatTheContractNames) {
  const std::vector<std::string> names = {"first", "a \"quoted\" näme"};
  const std::string line = frame_line(seen_frame(), names);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const json frame = json::parse(line);
  EXPECT_EQ(frame["frame"], 12);
  EXPECT_EQ(frame["time_s"], 0.4);
  EXPECT_EQ(frame["reason"], "visible");
  EXPECT_EQ(frame["state"], "shown");
  ASSERT_EQ(frame["visible"].size(), 1u);
  const json& seen = frame["visible"][0];
  EXPECT_EQ(seen["pattern"], "a \"quoted\" näme");
  EXPECT_EQ(seen["corners"], json({{0.5, 1.25}, {100.0, 2.0}, {101.0, 99.0}, {-3.0, 98.0}}));
  EXPECT_EQ(seen["rotation"], json({0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0})) << "by rows";
  EXPECT_EQ(seen["translation"], json({0.1, -0.2, 3.0000000000000004})) << "to the last bit";
  EXPECT_EQ(seen["inliers"], 61);
  EXPECT_EQ(seen["matches"], 80);
  EXPECT_EQ(frame["ms"]["detect"], 1.235);
  EXPECT_EQ(frame["ms"]["track"], 7.0);
  EXPECT_TRUE(frame["ms"].contains("render"));
}

TEST(JsonLines, TheHomographyTakesTheUnitSquareToTheCorners) {
  EXPECT_FALSE(json::parse(frame_line(seen_frame(), {}))["visible"][0].contains("homography"));
  FrameReport report = seen_frame();
  const json h = json::parse(frame_line(report, {}, true))["visible"][0]["homography"];
  ASSERT_EQ(h.size(), 9u);
  const auto row = [&](std::size_t i, double x, double y) {
    return h[i].get<double>() * x + h[i + 1].get<double>() * y + h[i + 2].get<double>();
  };
  const glm::dvec2 square[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto [x, y] = std::pair(square[i].x, square[i].y);
    EXPECT_NEAR(row(0, x, y) / row(6, x, y), report.visible[0].corners[i].x, 1e-9) << i;
    EXPECT_NEAR(row(3, x, y) / row(6, x, y), report.visible[0].corners[i].y, 1e-9) << i;
  }
  report.visible[0].corners[2] = report.visible[0].corners[0];
  EXPECT_TRUE(json::parse(frame_line(report, {}, true))["visible"][0]["homography"].is_null());
}

TEST(JsonLines, CornersOfAReducedStillAreInPixelsOfItsFile) {
  FrameReport report = seen_frame();
  report.reduced = 2;  // pixels have their centres at whole numbers: 0 of the still is 0.5
  EXPECT_EQ(json::parse(frame_line(report, {}))["visible"][0]["corners"],
            json({{1.5, 3.0}, {200.5, 4.5}, {202.5, 198.5}, {-5.5, 196.5}}));
}

TEST(JsonLines, WhatThePoseDoesNotExplainIsWrittenByRows) {
  FrameReport report = seen_frame();
  EXPECT_FALSE(json::parse(frame_line(report, {}))["visible"][0].contains("stretch"));
  report.visible[0].stretch[1].x = 0.25;
  report.visible[0].stretch[3] = {1, 2, 3};
  EXPECT_EQ(json::parse(frame_line(report, {}))["visible"][0]["stretch"],
            json({1.0, 0.25, 0.0, 1.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0}));
}

TEST(JsonLines, CopiesAreNumberedWhereSeveralAreTracked) {
  FrameReport report = seen_frame();
  report.visible[0].copy = 3;
  EXPECT_FALSE(json::parse(frame_line(report, {}))["visible"][0].contains("copy"));
  report.numbered = true;
  EXPECT_EQ(json::parse(frame_line(report, {}))["visible"][0]["copy"], 3);
}

TEST(JsonLines, AnExtendedPoseSaysSo) {
  FrameReport report = seen_frame();
  EXPECT_FALSE(json::parse(frame_line(report, {}))["visible"][0].contains("extended"));
  report.visible[0].extended = true;
  report.visible[0].position_sigma = 0.25;
  report.visible[0].rotation_sigma = 0.125;
  const json seen = json::parse(frame_line(report, {}))["visible"][0];
  EXPECT_EQ(seen["extended"], true);
  EXPECT_EQ(seen["position_sigma"], 0.25);
  EXPECT_EQ(seen["rotation_sigma"], 0.125);
}

TEST(JsonLines, AFrameWithoutPatternSaysWhyAndStaysJson) {
  FrameReport report;
  report.time_s = std::numeric_limits<double>::quiet_NaN();
  report.reason = Reason::kFewMatches;
  report.state = Shown::kHeld;
  const json frame = json::parse(frame_line(report, {}));
  EXPECT_TRUE(frame["visible"].is_array());
  EXPECT_TRUE(frame["visible"].empty());
  EXPECT_EQ(frame["reason"], "few matches");
  EXPECT_EQ(frame["state"], "held");
  EXPECT_TRUE(frame["time_s"].is_null());
}

TEST(JsonLines, TheSummaryCountsAndTakesMedians) {
  RunStats stats;
  FrameReport report = seen_frame();
  for (const double track : {9.0, 1.0, 5.0}) {
    report.at(Stage::kTrack) = track;
    stats.add(report);
  }
  FrameReport lost;
  lost.reason = Reason::kNoGeometry;
  lost.at(Stage::kTrack) = 100;
  lost.at(Stage::kLatency) = 40;
  stats.add(lost);
  stats.set_dropped(2);
  stats.set_skipped(3);
  const json summary = json::parse(summary_line(stats))["summary"];
  EXPECT_EQ(summary["frames"], 4);
  EXPECT_EQ(summary["visible"], 3);
  EXPECT_EQ(summary["dropped"], 2);
  EXPECT_EQ(summary["skipped"], 3);
  EXPECT_EQ(summary["late"], 1);
  EXPECT_EQ(summary["recognised_percent"], 75.0);
  EXPECT_EQ(summary["reasons"], json({{"visible", 3}, {"not in view", 1}}));
  EXPECT_EQ(summary["states"], json({{"shown", 3}, {"held", 0}, {"hidden", 1}}));
  EXPECT_EQ(summary["ms"]["track"], 5.0) << "the lower median of 1 5 9 100";
}

TEST(JsonLines, TheSummaryOfNothingIsJson) {
  const json summary = json::parse(summary_line(RunStats{}))["summary"];
  EXPECT_EQ(summary["frames"], 0);
  EXPECT_EQ(summary["recognised_percent"], 0.0);
}

}  // namespace
}  // namespace modar
