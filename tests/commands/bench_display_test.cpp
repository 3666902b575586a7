// Table 9's figures of a run that was worked out on paper.
#include "bake/extensions/lab/bench_parts.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace modar {
namespace {

std::string line(int frame, const char* time_s, const char* visible, const char* state,
                 const char* track, const char* latency) {
  return "{\"frame\":" + std::to_string(frame) + ",\"time_s\":" + time_s + ",\"visible\":[" +
         visible + "],\"reason\":\"visible\",\"state\":\"" + state +
         "\",\"ms\":{\"track\":" + track + ",\"latency\":" + latency + "}}\n";
}

/// Ten frames a second. Frame 2 was dropped; the model is on pictures 1, 3, 4, and lost then.
std::string good_lines() {
  return line(0, "0.0", "", "hidden", "999", "50") + line(1, "0.1", "{}", "shown", "100", "250") +
         line(3, "0.3", "{}", "shown", "300", "150") + line(4, "0.4", "", "held", "7", "450") +
         line(5, "0.5", "", "hidden", "7", "0.5") +
         "{\"summary\":{\"frames\":5,\"dropped\":1,\"late\":4}}\n";
}

const BenchRow& row(const std::vector<BenchRow>& rows, const std::string& measure) {
  static const BenchRow none;
  const auto found = std::ranges::find(rows, measure, &BenchRow::measure);
  EXPECT_NE(found, rows.end()) << measure;
  return found == rows.end() ? none : *found;
}

TEST(BenchDisplay, TellsTheArticlesFiguresOfARun) {
  const auto run = read_played_run(good_lines());
  ASSERT_TRUE(run) << to_line(run.error());
  const auto rows = display_rows("statue", *run);
  // The two frames with a pattern take 200 ms on average: 5 a second of the video's 10.
  EXPECT_DOUBLE_EQ(row(rows, "statue table9_recognition_fps_low_end").ours, 5);
  EXPECT_DOUBLE_EQ(row(rows, "statue table9_recognition_fps_low_end").reference, 28);
  // Seen and drawn at once, in the second frame.
  EXPECT_TRUE(std::isnan(row(rows, "statue table9_loading_fps_low_end").ours));
  EXPECT_DOUBLE_EQ(row(rows, "statue table9_loading_s_low_end").ours, 0.25);
  EXPECT_DOUBLE_EQ(row(rows, "statue table9_loading_s_mid_range").reference, 17);
  // Pictures of 0.1, 0.3 and 0.4 s: two steps in 0.3 s.
  EXPECT_NEAR(row(rows, "statue table9_display_fps_mid_range").ours, 2 / 0.3, 1e-9);
  EXPECT_NEAR(row(rows, "statue table9_display_fps_mid_range").ratio, 2 / 0.3 / 25, 1e-9);
  EXPECT_DOUBLE_EQ(row(rows, "statue table9_display_s_low_end").ours, 0.25);
  EXPECT_DOUBLE_EQ(row(rows, "statue table9_display_s_low_end").reference, 28);
  EXPECT_DOUBLE_EQ(row(rows, "statue table9_stutters_low_end").ratio, 2);
  EXPECT_TRUE(std::isnan(row(rows, "statue table9_stutters_mid_range").ratio));
  EXPECT_DOUBLE_EQ(row(rows, "statue pictures").ours, 5);
  EXPECT_DOUBLE_EQ(row(rows, "statue dropped_frames").ours, 1);
}

TEST(BenchDisplay, LoadingLastsFromTheFirstSightToTheFirstModel) {
  const auto run = read_played_run(
      line(0, "0", "", "hidden", "1", "5") + line(1, "0.1", "{}", "hidden", "1", "5") +
      line(2, "0.2", "{}", "hidden", "1", "5") + line(3, "0.5", "{}", "shown", "1", "40") +
      "{\"summary\":{\"dropped\":0,\"late\":0}}\n");
  ASSERT_TRUE(run) << to_line(run.error());
  const auto rows = display_rows("bust", *run);
  EXPECT_NEAR(row(rows, "bust table9_loading_fps_low_end").ours, 2 / 0.4, 1e-9);
  EXPECT_DOUBLE_EQ(row(rows, "bust table9_loading_fps_low_end").reference, 12);
  EXPECT_NEAR(row(rows, "bust table9_loading_s_low_end").ours, 0.44, 1e-9);
}

TEST(BenchDisplay, VisionIsNoFasterThanTheCamera) {
  const auto run = read_played_run(line(0, "0", "{}", "shown", "1", "5") +
                                   line(3, "0.1", "{}", "shown", "1", "5") +
                                   "{\"summary\":{\"dropped\":2,\"late\":0}}\n");
  ASSERT_TRUE(run) << to_line(run.error());
  const auto rows = display_rows("spider", *run);
  EXPECT_NEAR(row(rows, "spider table9_recognition_fps_low_end").ours, 30, 1e-9);
  EXPECT_TRUE(std::isnan(row(rows, "spider table9_recognition_fps_low_end").reference));
}

TEST(BenchDisplay, WithoutAModelThereIsNoRateOfDisplay) {
  const auto run = read_played_run(line(0, "0", "", "hidden", "1", "5") +
                                   "{\"summary\":{\"dropped\":0,\"late\":0}}\n");
  ASSERT_TRUE(run) << to_line(run.error());
  const auto rows = display_rows("bust", *run);
  for (const char* figure : {"recognition_fps", "display_fps", "display_s"}) {
    EXPECT_TRUE(std::isnan(row(rows, std::string("bust table9_") + figure + "_low_end").ours));
  }
}

TEST(BenchDisplay, LinesOfAnotherPlayerAreTold) {
  const std::string good = good_lines();
  const std::string head = good.substr(0, good.find("{\"summary\""));
  for (const std::string& bad :
       {head, head + "{\"summary\":{}}\n", good + good, std::string("[]\n"),
        std::string("{\"frame\":-1}\n"), std::string("no JSON\n"), std::string()}) {
    const auto run = read_played_run(bad);
    ASSERT_FALSE(run) << bad;
    EXPECT_EQ(run.error().exit, ExitCode::kInvalidInput);
  }
  EXPECT_EQ(read_played_run(head + "x\n").error().where, "line 6");
}

}  // namespace
}  // namespace modar
