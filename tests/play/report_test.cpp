// The report's page and the report as a whole.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <regex>

#include "files.hpp"
#include "runtime/play/frame_report.hpp"
#include "runtime/play/frame_sink.hpp"
#include "runtime/play/report_page.hpp"

namespace modar {
namespace {

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

std::vector<PageFrame> frames() {
  std::vector<PageFrame> frames(6);
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].frame = i;
  frames[1].seen = true;
  frames[1].reason = Reason::kVisible;
  for (std::size_t i : {2u, 3u}) {
    frames[i] = {i, 0.1, Shown::kShown, Reason::kVisible, true, 33, 44, "box <front>"};
  }
  frames[4].state = Shown::kHeld;
  frames[4].reason = Reason::kFewMatches;
  return frames;
}

TEST(ReportPage, StripHasARunForEachStretchOfEqualStates) {
  const std::string page = report_page({"a.modar", "b.mp4", "paper", ""}, 25, frames(), RunStats{});
  EXPECT_NE(page.find("viewBox=\"0 0 6 1\""), std::string::npos);
  EXPECT_NE(page.find("<rect class=shown x=2 width=2 "), std::string::npos);
  EXPECT_NE(page.find("<rect class=held x=4 width=1 height=1><title>held: few matches</title>"),
            std::string::npos);
  EXPECT_EQ(count(page, "<rect class="), 5u);
  EXPECT_EQ(count(page, "<tr class="), 6u);
  EXPECT_NE(page.find("seen once"), std::string::npos);
  EXPECT_NE(page.find("fps=25.000000;"), std::string::npos);
}

TEST(ReportPage, NamesCannotBreakThePageAndNothingComesFromTheNet) {
  const std::string page =
      report_page({"<script>x</script>", "a\"b&c", "paper", ""}, 30, frames(), RunStats{});
  EXPECT_EQ(count(page, "<script>"), 1u);
  EXPECT_NE(page.find("&lt;script&gt;x"), std::string::npos);
  EXPECT_NE(page.find("box &lt;front&gt;"), std::string::npos);
  EXPECT_NE(page.find("a&quot;b&amp;c"), std::string::npos);
  EXPECT_EQ(count(page, "http"), 0u);
}

TEST(ReportPage, SaysThatItWasDrawnInSoftware) {
  const ReportTitle title{"a", "b", "ours", "llvmpipe (LLVM 15.0.6, 256 bits)"};
  EXPECT_NE(report_page(title, 30, {}, RunStats{}).find("in software"), std::string::npos);
  const ReportTitle phone{"a", "b", "ours", "Mali-400 MP"};
  EXPECT_EQ(report_page(phone, 30, {}, RunStats{}).find("in software"), std::string::npos);
}

TEST(ReportPage, IsAPageWithoutFramesToo) {
  EXPECT_NE(report_page({"a", "b", "paper", ""}, 30, {}, RunStats{}).find("</html>"),
            std::string::npos);
}

TEST(Report, LeavesMovieSheetLinesAndPage) {
  const test::Folder folder;
  const std::vector<std::string> names = {"box"};
  auto report = open_report(folder / "r", 30, {"a.modar", "b.mp4", "paper", ""}, names);
  ASSERT_TRUE(report) << to_line(report.error());
  std::vector<std::uint8_t> pixels(64 * 48 * 4, 128);
  for (std::uint64_t i = 0; i < 60; ++i) {
    std::fill(pixels.begin(), pixels.end(), static_cast<std::uint8_t>(100 + i));
    FrameReport frame;
    frame.frame = i;
    frame.state = i < 30 ? Shown::kShown : Shown::kHidden;
    ASSERT_TRUE((*report)->picture({pixels, 64, 48}, frame));
    ASSERT_TRUE((*report)->line(frame, frame_line(frame, names)));
  }
  ASSERT_TRUE((*report)->finish("{\"summary\":{}}"));
  report->reset();
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "r"), {}), 5);

  std::istringstream lines(test::read_text(folder / "r/frames.jsonl"));
  std::string line;
  int n = 0;
  for (; std::getline(lines, line); ++n) EXPECT_TRUE(nlohmann::json::accept(line)) << line;
  EXPECT_EQ(n, 61);
  const cv::Mat sheet = cv::imread(folder / "r/contact_sheet.png");
  EXPECT_EQ(sheet.cols, 4 * 326 + 6);
  EXPECT_EQ(sheet.rows, 6 * 264 + 6) << "24 cells of 320x240 with a label";
  const cv::Mat poster = cv::imread(folder / "r/poster.png");
  EXPECT_EQ(poster.size(), cv::Size(64, 48));
  EXPECT_EQ(poster.at<cv::Vec3b>(20, 20), cv::Vec3b(115, 115, 115)) << "the 16th, with a model";
  EXPECT_EQ(count(test::read_text(folder / "r/index.html"), "<tr class="), 60u);
  EXPECT_GT(std::filesystem::file_size(folder / "r/overlay.mp4"), 500u);
}

TEST(Report, LeavesNothingHalfMade) {
  const test::Folder folder;
  {
    auto report = open_report(folder / "r", 30, {"a", "b", "paper", ""}, {});
    ASSERT_TRUE(report);
    std::vector<std::uint8_t> pixels(64 * 48 * 4, 128);
    ASSERT_TRUE((*report)->picture({pixels, 64, 48}, {}));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder / "r"));
}

}  // namespace
}  // namespace modar
