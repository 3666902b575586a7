// Recordings: written files read back, and a replay that differs is found out.
#include "runtime/play/recording.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "files.hpp"
#include "runtime/play/frame_report.hpp"

namespace modar {
namespace {

const std::vector<std::string> kNames = {"box", "card"};

FrameReport report_at(std::uint64_t number) {
  FrameReport report;
  report.frame = number;
  report.time_s = static_cast<double>(number) / 30;
  if (number == 1) return report;
  Detection seen;
  seen.pattern = 1;
  const auto x = static_cast<double>(number);
  seen.corners = {{{x, 0.1}, {x + 90, 0}, {x + 90, 80}, {x, 80}}};
  report.visible = {seen};
  report.reason = Reason::kVisible;
  report.state = number > 2 ? Shown::kShown : Shown::kHidden;
  return report;
}

Frame frame_at(std::uint64_t number) {
  Frame frame;
  frame.index = number;
  frame.width = 3;
  frame.height = 2;
  frame.rgb.assign(18, static_cast<std::uint8_t>(50 * number));
  frame.rgb[0] = 7;
  return frame;
}

RecordingHead head() {
  RecordingHead head{"paper", "orb-2000", 25, 0xFEDCBA9876543210u, {}};
  head.camera.width = 640;
  head.camera.height = 480;
  head.camera.fx = 500.125;
  head.camera.distortion[4] = -0.25;
  return head;
}

void record(const std::string& folder) {
  auto recorder = Recorder::create(folder, head());
  ASSERT_TRUE(recorder) << to_line(recorder.error());
  for (std::uint64_t i = 0; i < 5; ++i) {
    ASSERT_TRUE((*recorder)->add(frame_at(i), frame_line(report_at(i), kNames)));
  }
  ASSERT_TRUE((*recorder)->finish());
}

TEST(Recording, ReadsBackAsItWasWritten) {
  const test::Folder folder;
  record(folder / "r");
  const auto recording = read_recording(folder / "r");
  ASSERT_TRUE(recording) << to_line(recording.error());
  EXPECT_EQ(recording->head.parameters, "orb-2000");
  EXPECT_EQ(recording->head.bundle_hash, 0xFEDCBA9876543210u);
  EXPECT_EQ(recording->head.camera.fx, 500.125);
  EXPECT_EQ(recording->head.camera.distortion[4], -0.25);
  ASSERT_EQ(recording->frames.size(), 5u);
  EXPECT_TRUE(recording->frames[1].visible.empty());
  EXPECT_EQ(recording->frames[3].state, "shown");
  EXPECT_EQ(recording->frames[3].visible[0].pattern, "card");
  EXPECT_EQ(recording->frames[3].visible[0].corners[0], glm::dvec2(3, 0.1));
  const cv::Mat picture = cv::imread(folder / "r/frames/frame_000002.png");
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 0), cv::Vec3b(100, 100, 7));
  EXPECT_EQ(picture.at<cv::Vec3b>(1, 2), cv::Vec3b(100, 100, 100));
}

GoldenCheck check_of(const test::Folder& folder) {
  record(folder / "r");
  return GoldenCheck(*read_recording(folder / "r"), 0.5);
}

nlohmann::json result(const GoldenCheck& check) {
  return nlohmann::json::parse(check.line())["golden"];
}

TEST(Golden, AnEqualRunIsGood) {
  const test::Folder folder;
  GoldenCheck check = check_of(folder);
  for (std::uint64_t i = 0; i < 5; ++i) check.add(report_at(i), kNames);
  EXPECT_TRUE(check.good());
  EXPECT_EQ(result(check)["different"], 0);
  EXPECT_EQ(result(check)["compared"], 5);
  EXPECT_EQ(result(check)["worst_px"], 0.0);
}

TEST(Golden, CornersMayMoveByTheToleranceAndNoMore) {
  const test::Folder folder;
  for (const auto& [shift, good] : {std::pair{0.4, true}, {0.6, false}}) {
    GoldenCheck check = check_of(folder);
    for (std::uint64_t i = 0; i < 5; ++i) {
      FrameReport report = report_at(i);
      if (i == 3) {
        for (glm::dvec2& corner : report.visible[0].corners) corner.x += shift;
      }
      check.add(report, kNames);
    }
    EXPECT_EQ(check.good(), good);
    EXPECT_NEAR(result(check)["worst_px"].get<double>(), shift, 1e-12);
    if (!good) {
      EXPECT_EQ(result(check)["first"]["frame"], 3);
    }
  }
}

TEST(Golden, FindsALostPatternAnotherStateAnotherPatternAndMissingFrames) {
  const test::Folder folder;
  const auto differs = [&folder](auto change) {
    GoldenCheck check = check_of(folder);
    for (std::uint64_t i = 0; i < 5; ++i) {
      FrameReport report = report_at(i);
      if (i == 4) change(report);
      check.add(report, kNames);
    }
    return !check.good();
  };
  EXPECT_FALSE(differs([](FrameReport&) {}));
  EXPECT_TRUE(differs([](FrameReport& report) { report.visible.clear(); }));
  EXPECT_TRUE(differs([](FrameReport& report) { report.state = Shown::kHeld; }));
  EXPECT_TRUE(differs([](FrameReport& report) { report.visible[0].pattern = 0; }));
  EXPECT_TRUE(differs([](FrameReport& report) { report.frame = 9; }));
  EXPECT_TRUE(differs([](FrameReport& report) { report.visible[0].corners[0].x = NAN; }));
  GoldenCheck few = check_of(folder);
  few.add(report_at(0), kNames);
  EXPECT_FALSE(few.good());
}

TEST(Recording, SaysWhichLineIsDamaged) {
  const test::Folder folder;
  record(folder / "r");
  const std::string text = test::read_text(folder / "r/poses.jsonl");
  EXPECT_EQ(read_recording(folder / "none").error().exit, ExitCode::kIo);
  const std::size_t second = text.find('\n') + 1;
  for (const char* line : {"", "{", "[]", "{\"frame\":-1}", "{\"frame\":0,\"visible\":{}}",
                           "{\"frame\":0,\"visible\":[{}],\"state\":\"shown\"}"}) {
    test::write_text(folder / "r/poses.jsonl",
                     text.substr(0, second) + line + "\n" + text.substr(second));
    const auto recording = read_recording(folder / "r");
    ASSERT_FALSE(recording) << line;
    EXPECT_EQ(recording.error().code, "golden.damaged");
    EXPECT_TRUE(recording.error().where.ends_with("poses.jsonl:2")) << recording.error().where;
  }
  test::write_text(folder / "r/poses.jsonl", text.substr(second));
  EXPECT_FALSE(read_recording(folder / "r")) << "no head";
}

}  // namespace
}  // namespace modar
