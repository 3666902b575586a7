// The player's command line.
#include "runtime/play/options.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "runtime/play/decimal.hpp"

namespace modar {
namespace {

Result<PlayOptions> parse(std::vector<const char*> arguments) {
  return parse_options(arguments);
}

std::string code_of(std::vector<const char*> arguments) {
  const Result<PlayOptions> options = parse_options(arguments);
  if (options) return "parsed";
  EXPECT_EQ(options.error().exit, ExitCode::kUsage);
  EXPECT_NE(options.error().cure.find("--help"), std::string::npos);
  return options.error().code;
}

TEST(Options, ReadsEachOption) {
  const auto options = parse({"--json",
                              "a.modar",
                              "--input",
                              "v.mp4",
                              "--out=o.mp4",
                              "--camera",
                              "c.yml",
                              "--method",
                              "paper",
                              "--parameters",
                              "brisk-3",
                              "--device",
                              "mali400",
                              "--window",
                              "--realtime",
                              "--report",
                              "r",
                              "--outline",
                              "--no-light-estimate",
                              "--quiet"});
  ASSERT_TRUE(options) << to_line(options.error());
  EXPECT_EQ(options->bundle, "a.modar");
  EXPECT_EQ(options->input, "v.mp4");
  EXPECT_EQ(options->out, "o.mp4");
  EXPECT_EQ(options->camera_file, "c.yml");
  EXPECT_EQ(options->method, "paper");
  EXPECT_EQ(options->parameters, "brisk-3");
  EXPECT_EQ(options->device, "mali400");
  EXPECT_EQ(options->report, "r");
  EXPECT_TRUE(options->json && options->window && options->realtime && options->outline &&
              options->quiet);
}

TEST(Options, AGyroscopeHelpsExtendedPosesOnly) {
  const auto options = parse({"a.modar", "--input", "v", "--extended", "--gyro", "turns.txt"});
  ASSERT_TRUE(options);
  EXPECT_TRUE(options->extended);
  EXPECT_EQ(options->gyro, "turns.txt");
  EXPECT_EQ(code_of({"a.modar", "--input", "v", "--gyro", "turns.txt"}), "usage.conflict");
}

TEST(Options, CopiesAreOneToSixteenAndNotRecorded) {
  EXPECT_EQ(parse({"a.modar", "--input", "v"})->copies, 0);
  EXPECT_EQ(parse({"a.modar", "--input", "v", "--record", "r"})->copies, 1);
  EXPECT_EQ(parse({"a.modar", "--input", "v", "--copies", "16"})->copies, 16);
  for (const char* bad : {"0", "17", "-1", "two"}) {
    EXPECT_EQ(code_of({"a.modar", "--input", "v", "--copies", bad}), "usage.value") << bad;
  }
  EXPECT_EQ(code_of({"a.modar", "--input", "v", "--copies", "2", "--record", "r"}),
            "usage.conflict");
}

TEST(Options, TurntableNeedsAPlaceAndNoInput) {
  const auto options = parse({"a.modar", "--turntable", "12", "--out", "d", "--size", "320x200"});
  ASSERT_TRUE(options);
  EXPECT_EQ(options->turntable, 12);
  EXPECT_EQ(options->width, 320);
  EXPECT_EQ(options->height, 200);
  EXPECT_EQ(code_of({"a.modar", "--turntable", "12"}), "usage.out");
  EXPECT_EQ(code_of({"a.modar", "--turntable", "12", "--out", "d", "--input", "v"}),
            "usage.conflict");
}

TEST(Options, RecordingsLogsAndBudgets) {
  const auto options = parse({"a.modar", "--input", "v", "--record", "r", "--qos", "q.jsonl",
                              "--osd", "--gpu-budget", "64M"});
  ASSERT_TRUE(options) << to_line(options.error());
  EXPECT_EQ(options->record, "r");
  EXPECT_EQ(options->qos, "q.jsonl");
  EXPECT_TRUE(options->osd);
  EXPECT_EQ(options->gpu_budget, 64u << 20);
  EXPECT_EQ(parse({"a.modar", "--golden", "r", "--tolerance", "0.25"})->tolerance, 0.25);
  EXPECT_EQ(code_of({"a.modar", "--golden", "r", "--tolerance", "-1"}), "usage.value");
  EXPECT_EQ(code_of({"a.modar", "--golden", "r", "--tolerance", "nan"}), "usage.value");
  EXPECT_EQ(code_of({"a.modar", "--golden", "r", "--record", "s"}), "usage.conflict");
  EXPECT_EQ(code_of({"a.modar", "--input", "v", "--gpu-budget", "0"}), "usage.value");
}

TEST(Options, AmountsOfMemory) {
  EXPECT_EQ(parse_bytes("1"), 1u);
  EXPECT_EQ(parse_bytes("3K"), 3072u);
  EXPECT_EQ(parse_bytes("2G"), std::uint64_t{2} << 30);
  for (const char* bad : {"", "M", "1T", "-1", "1.5M", "99999999999G", "1 M", "1m"}) {
    EXPECT_EQ(parse_bytes(bad), 0u) << bad;
  }
}

TEST(Options, DecimalsAreTheNearestDouble) {
  const std::pair<const char*, double> good[] = {{"0", 0},
                                                 {"30", 30},
                                                 {"29.97", 29.97},
                                                 {"0.1", 0.1},
                                                 {".5", 0.5},
                                                 {"7.", 7},
                                                 {"123456789.012345", 123456789.012345}};
  for (const auto& [text, expected] : good) {
    double value = -1;
    EXPECT_TRUE(parse_decimal(text, value)) << text;
    EXPECT_EQ(value, expected) << text;
  }
  for (const char* bad : {"", ".", "1.2.3", "1e3", "+1", "-1", " 1", "1234567890123456", "nan"}) {
    double value = -1;
    EXPECT_FALSE(parse_decimal(bad, value)) << bad;
  }
}

TEST(Options, HelpAndVersionNeedNothingElse) {
  EXPECT_TRUE(parse({"--help"})->help);
  EXPECT_TRUE(parse({"--version"})->version);
  EXPECT_TRUE(parse({"--help-all"})->help_all);
  EXPECT_NE(help_text(false).find("Example:"), std::string::npos);
  EXPECT_EQ(help_text(false).find("--tolerance"), std::string::npos);
  EXPECT_NE(help_text(true).find("--tolerance"), std::string::npos);
}

TEST(Options, RefusesWhatIsNotThere) {
  EXPECT_EQ(code_of({}), "usage.bundle");
  EXPECT_EQ(code_of({"a.modar"}), "usage.input");
  EXPECT_EQ(code_of({"a.modar", "b.modar", "--input", "v"}), "usage.argument");
  EXPECT_EQ(code_of({"a.modar", "--bogus"}), "usage.option");
  EXPECT_EQ(code_of({"a.modar", "-x"}), "usage.option");
  EXPECT_EQ(code_of({"a.modar", "--json=3"}), "usage.value");
  EXPECT_EQ(code_of({"a.modar", "--input"}), "usage.value");
  EXPECT_EQ(code_of({"a.modar", "--turntable", "0", "--out", "d"}), "usage.value");
  EXPECT_EQ(code_of({"a.modar", "--turntable", "3x", "--out", "d"}), "usage.value");
  EXPECT_EQ(code_of({"a.modar", "--input", "v", "--size", "640"}), "usage.value");
  EXPECT_EQ(code_of({"a.modar", "--input", "v", "--size", "0x480"}), "usage.value");
  EXPECT_EQ(code_of({"a.modar", "--input", "v", "--method", "magic"}), "usage.method");
}

TEST(Options, NamesTheOptionThatItRefuses) {
  EXPECT_NE(parse({"a.modar", "--bogus"}).error().cause.find("--bogus"), std::string::npos);
  EXPECT_NE(parse({"a.modar", "-x"}).error().cause.find("-x"), std::string::npos);
}

TEST(Options, ParsesTwiceInOneProcess) {
  EXPECT_TRUE(parse({"a.modar", "--input", "v"}));
  const auto again = parse({"b.modar", "--input", "w"});
  ASSERT_TRUE(again);
  EXPECT_EQ(again->bundle, "b.modar");
}

}  // namespace
}  // namespace modar
