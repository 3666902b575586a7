// Sizes as people read them.
#include "bake/io/terminal.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace modar {
namespace {

TEST(HumanBytes, ThreeDigits) {
  EXPECT_EQ(human_bytes(0), "0 B");
  EXPECT_EQ(human_bytes(999), "999 B");
  EXPECT_EQ(human_bytes(1000), "1.00 kB");
  EXPECT_EQ(human_bytes(12345), "12.3 kB");
  EXPECT_EQ(human_bytes(999499), "999 kB");
  EXPECT_EQ(human_bytes(999500), "1.00 MB");
  EXPECT_EQ(human_bytes(206700000), "207 MB");
}

TEST(TimeLeft, ComesFromThePartThatIsDone) {
  EXPECT_EQ(time_left(0.25, 10), ", about 30 s left");
  EXPECT_EQ(time_left(0.5, 600), ", about 10 min left");
  EXPECT_EQ(time_left(0.5, 99), ", about 99 s left");
  EXPECT_EQ(time_left(0.5, 100), ", about 2 min left");
  EXPECT_EQ(time_left(0.5, 5), ", about 5 s left");
  EXPECT_EQ(time_left(0.5, 4.9), "");  // too early to tell
  EXPECT_EQ(time_left(0, 60), "");
  EXPECT_EQ(time_left(1, 60), "");
}

TEST(Losses, AreTheTexturesAndManyFacesOfAModelEachOnce) {
  constexpr auto kWarning = DiagnosticSeverity::kWarning;
  const std::vector<Diagnostic> findings = {
      {"mtl.missing-map", kWarning, "a.mtl", 3, "texture 'a.png' was not found", ""},
      {"mtl.missing-map", kWarning, "a.mtl", 7, "texture 'a.png' was not found", ""},
      {"model.lost", kWarning, "a", 0, "2 of 30 faces could not be used", ""},
      {"model.degenerate", kWarning, "a", 0, "9 triangles without area left out", ""},
      {"image.decode", kWarning, "b.png", 0, "it is cut short; grey replaces it", ""},
      {"image.decode", DiagnosticSeverity::kInfo, "c.png", 0, "it is large", ""}};
  testing::internal::CaptureStderr();
  print_losses(findings);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "not complete: texture 'a.png' was not found\n"
            "not complete: 2 of 30 faces could not be used\n"
            "not complete: 'b.png': it is cut short; grey replaces it\n");
}

TEST(Findings, AreFourKindsOfNotesAndThreeWarningsOfAKind) {
  const auto said = [](DiagnosticSeverity severity, const std::vector<std::string>& ids, bool all) {
    std::vector<Diagnostic> findings;
    for (const std::string& id : ids) {
      findings.push_back({id, severity, "a.obj", findings.size() + 1, "it is odd", ""});
    }
    testing::internal::CaptureStderr();
    print_findings(findings, all);
    const std::string text = testing::internal::GetCapturedStderr();
    return std::pair{std::ranges::count(text, '\n'), text};
  };
  constexpr auto kInfo = DiagnosticSeverity::kInfo;
  EXPECT_EQ(said(kInfo, {"a", "b", "c", "d"}, false).first, 4);
  EXPECT_EQ(said(kInfo, {"a", "b", "c", "d"}, false).second.find("more"), std::string::npos);
  const auto [lines, text] = said(kInfo, {"a", "b", "c", "d", "e", "e"}, false);
  EXPECT_EQ(lines, 5);
  EXPECT_TRUE(text.ends_with("\nnote: 2 more notes; --notes shows them\n")) << text;
  EXPECT_EQ(said(kInfo, {"a", "b", "c", "d", "e", "e"}, true).first, 6);
  constexpr auto kWarning = DiagnosticSeverity::kWarning;
  EXPECT_EQ(said(kWarning, {"a", "a", "a", "b"}, false).first, 4);
  EXPECT_EQ(said(kWarning, {"a", "a", "a", "b"}, false).second.find("more"), std::string::npos);
  const auto [few, more] = said(kWarning, {"a", "a", "a", "a", "a"}, false);
  EXPECT_EQ(few, 3);
  EXPECT_NE(more.find("; 2 more of this kind: --notes shows them [a]\n"), std::string::npos);
}

TEST(ProcessCost, IsPositive) {
  EXPECT_GT(process_cost().peak_rss_bytes, 100000u);
}

}  // namespace
}  // namespace modar
