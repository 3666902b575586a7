// The log of a field trial, read by another JSON library.
#include "runtime/play/frame_report.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "files.hpp"

namespace modar {
namespace {

using nlohmann::json;
const std::vector<std::string> kOneName = {"box"};

TEST(Qos, LogsHeadEventsSecondsAndSummary) {
  const test::Folder folder;
  const std::string path = folder / "trial.jsonl";
  auto log = QosLog::create(path, {"a.modar", "camera", "paper", "orb-500", "Mali", "ES 2", ""});
  ASSERT_TRUE(log) << to_line(log.error());
  for (std::uint64_t i = 0; i < 50; ++i) {
    FrameReport report;
    report.frame = i;
    report.time_s = static_cast<double>(i) / 20;
    report.reason = Reason::kFewMatches;
    if (i >= 5 && i < 30) {
      report.visible.resize(1);
      report.visible[0].inliers = 44;
      report.reason = Reason::kVisible;
      report.state = Shown::kShown;
    }
    report.at(Stage::kTrack) = static_cast<double>(i % 20);
    report.at(Stage::kLatency) = i % 20 == 0 ? 50 : 5;
    if (log->due(report)) {
      MemoryByKind memory;
      memory.gpu_textures = 77;
      ASSERT_TRUE(log->window(memory));
    }
    ASSERT_TRUE(log->add(report, kOneName));
  }
  EXPECT_FALSE(std::filesystem::exists(path)) << "not before it is whole";
  ASSERT_TRUE(log->finish("{\"summary\":{}}"));

  std::istringstream text(test::read_text(path));
  std::vector<json> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(json::parse(line));
  ASSERT_EQ(lines.size(), 6u);
  EXPECT_EQ(lines[0]["qos"]["gl_renderer"], "Mali");
  EXPECT_EQ(lines[1]["event"], "found");
  EXPECT_EQ(lines[1]["frame"], 5);
  EXPECT_EQ(lines[1]["inliers"], 44);
  const json& second = lines[2]["second"];
  EXPECT_EQ(second["frames"], 20);
  EXPECT_EQ(second["visible"], 15);
  EXPECT_EQ(second["hidden"], 5);
  EXPECT_EQ(second["late"], 1);
  EXPECT_EQ(second["reasons"], json({{"visible", 15}, {"few matches", 5}}));
  EXPECT_EQ(second["ms"]["track"]["median"], 9.0);
  EXPECT_EQ(second["ms"]["track"]["p95"], 18.0);
  EXPECT_EQ(second["ms"]["track"]["max"], 19.0);
  EXPECT_EQ(second["memory"]["gpu_textures"], 77);
  EXPECT_EQ(lines[3]["event"], "lost");
  EXPECT_EQ(lines[3]["reason"], "few matches");
  EXPECT_EQ(lines[3]["after_s"], 1.25);
  EXPECT_TRUE(lines[4].contains("second"));
  EXPECT_TRUE(lines[5].contains("summary"));
}

TEST(Qos, MeasuresWhatIsTouchedOfAMapping) {
  constexpr std::size_t kPages = 64;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  void* start =
      mmap(nullptr, kPages * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(start, MAP_FAILED);
  ASSERT_EQ(madvise(start, kPages * page, MADV_NOHUGEPAGE), 0);
  const std::span<std::byte> bytes(static_cast<std::byte*>(start), kPages * page);
  EXPECT_EQ(measure_memory(bytes).bundle_resident, 0u);
  for (const std::size_t i : {0u, 5u, 63u}) bytes[i * page] = std::byte{1};
  const MemoryByKind memory = measure_memory(bytes);
  EXPECT_EQ(memory.bundle, kPages * page);
  EXPECT_EQ(memory.bundle_resident, 3 * page);
  EXPECT_GT(memory.resident, std::uint64_t{1} << 20);
  munmap(start, kPages * page);
}

}  // namespace
}  // namespace modar
