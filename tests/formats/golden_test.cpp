// One bundle of each released version: read forever, by both readers, with the same result.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <string>

#include "formats/bundle_view.hpp"
#include "formats/check.hpp"
#include "formats/content_summary.hpp"
#include "tests/formats/dump.hpp"
#include "tests/formats/support.hpp"

namespace {

using namespace modar;
using namespace modar::test;

struct Answer {
  int exit = -1;
  std::string text;  ///< stdout, then stderr
};

Answer second_reader(const std::string& arguments) {
  const std::string command = std::string("\"") + MODAR_PYTHON + "\" -B \"" +
                              source_path("scripts/read_bundle.py") + "\" " + arguments + " 2>&1";
  Answer answer;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return answer;
  std::array<char, 4096> part{};
  for (std::size_t size = 0; (size = std::fread(part.data(), 1, part.size(), pipe)) > 0;) {
    answer.text.append(part.data(), size);
  }
  const int status = pclose(pipe);
  answer.exit = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return answer;
}

std::string quoted(const std::string& path) {
  return "\"" + path + "\"";
}

/// A released file never changes. Version 1.1 is 1.0 and a content summary, 1.2 that with light,
/// occlusion, a shadow and shapes of patterns, 1.3 that with nodes and actions, 1.4 that
/// with clips, so its writer makes all.
TEST(GoldenFiles, WriterMakesTheReleasedBytes) {
  BundleContent content = golden_content();
  EXPECT_EQ(encode(content), read_file(source_path("tests/golden/v1_0.modar")));
  content.summary = content_summary_of(content);
  EXPECT_EQ(encode(content), read_file(source_path("tests/golden/v1_1.modar")));
  add_looks(content);
  content.summary = content_summary_of(content);
  EXPECT_EQ(encode(content), read_file(source_path("tests/golden/v1_2.modar")));
  add_nodes(content);
  content.summary.clear();
  content.summary = content_summary_of(content);
  EXPECT_EQ(encode(content), read_file(source_path("tests/golden/v1_3.modar")));
  add_clips(content);
  content.summary.clear();
  content.summary = content_summary_of(content);
  EXPECT_EQ(encode(content), read_file(source_path("tests/golden/v1_4.modar")));
}

class Golden : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Versions, Golden,
                         ::testing::Values("v1_0", "v1_1", "v1_2", "v1_3", "v1_4"));

TEST_P(Golden, BothReadersDecodeTheSame) {
  const std::string path = source_path(std::string("tests/golden/") + GetParam() + ".modar");
  const Bytes bytes = read_file(path);
  const auto view = BundleView::open(bytes);
  ASSERT_TRUE(view) << to_line(view.error());
  const Answer answer = second_reader(quoted(path) + " --json");
  ASSERT_EQ(answer.exit, 0) << answer.text;
  const auto theirs = nlohmann::json::parse(answer.text, nullptr, false);
  ASSERT_FALSE(theirs.is_discarded()) << answer.text;
  const auto ours = dump(*view);
  EXPECT_EQ(ours, theirs) << nlohmann::json::diff(ours, theirs).dump(1);
}

TEST(SecondReader, DecodesProxiesAsOursDoes) {
  BundleContent content = lit_content();
  add_proxies(content);
  content.patterns[0].copies = 5;
  content.summary = content_summary_of(content);
  const Bytes bytes = encode(content);
  EXPECT_EQ(report(bytes), std::vector<std::string>{"good"});
  const std::string path = std::string(::testing::TempDir()) + "proxies.modar";
  ASSERT_TRUE(save_bundle(content, path));
  const Answer answer = second_reader(quoted(path) + " --json");
  std::remove(path.c_str());
  ASSERT_EQ(answer.exit, 0) << answer.text;
  const auto ours = dump(*BundleView::open(bytes));
  EXPECT_EQ(ours["proxy_levels"].size(), 4u);
  const auto theirs = nlohmann::json::parse(answer.text, nullptr, false);
  EXPECT_EQ(ours, theirs) << nlohmann::json::diff(ours, theirs).dump(1);
}

TEST(GoldenFiles, FullOutputHasEveryValue) {
  const Answer answer =
      second_reader(quoted(source_path("tests/golden/v1_0.modar")) + " --json --full");
  ASSERT_EQ(answer.exit, 0) << answer.text;
  const auto all = nlohmann::json::parse(answer.text, nullptr, false);
  // The octahedron's corners are exact in every layout but for the sixteenth bit.
  for (const auto& level : all["levels"]) {
    ASSERT_EQ(level["positions_values"].size(), 6u);
    EXPECT_EQ(level["positions_values"][3], nlohmann::json({0.0, -1.0, 0.0}));
  }
  const auto down = all["levels"][3]["normals_values"][5];
  EXPECT_LT(down[2].get<double>(), -0.99);
}

/// Whatever our checker calls bad, the second reader refuses, for a reason that ours names too.
TEST(SecondReader, AgreesOnEveryCorruptFile) {
  const std::string folder = source_path("tests/corrupt/");
  std::string files;
  for (const IssueKind& kind : issue_kinds()) files += quoted(folder + kind.id + ".modar") + " ";
  const Answer answer = second_reader(files);
  EXPECT_EQ(answer.exit, 3);
  for (const IssueKind& kind : issue_kinds()) {
    const std::string path = folder + kind.id + ".modar";
    const auto at = answer.text.find(path + ": ");
    ASSERT_NE(at, std::string::npos) << kind.id << "\n" << answer.text;
    const std::string line = answer.text.substr(at + path.size() + 2, 80);
    const std::string theirs = line.substr(0, line.find(':'));
    const auto ours = report(read_file(path));
    if (std::strcmp(kind.id, "PATTERN_YML_DIFFERS") == 0) {
      EXPECT_EQ(theirs, "error PATTERN_YML_DIFFERS");  // ours compares them on a workstation alone
      continue;
    }
    if (ours.back() == "good") {
      EXPECT_NE(answer.text.find(path + ": good"), std::string::npos) << kind.id << ": " << line;
      continue;
    }
    EXPECT_TRUE(std::any_of(
        ours.begin(), ours.end(),
        [&theirs](const std::string& issue) { return issue.starts_with(theirs + " "); }))
        << kind.id << ": " << line;
  }
}

TEST(SecondReader, TellsUsageAndMissingFiles) {
  EXPECT_EQ(second_reader("/nonexistent.modar").exit, 2);
  EXPECT_EQ(second_reader("").exit, 1);
  EXPECT_EQ(second_reader("a --wrong").exit, 1);
}

}  // namespace
