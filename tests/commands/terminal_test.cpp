// Sizes as people read them.
#include "bake/io/terminal.hpp"

#include <gtest/gtest.h>

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

TEST(ProcessCost, IsPositive) {
  EXPECT_GT(process_cost().peak_rss_bytes, 100000u);
}

}  // namespace
}  // namespace modar
