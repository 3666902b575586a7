// The table of options: every row is read from the command line and from modar.toml alike, and
// comes back from a bundle's meta text.
#include "bake/options/options.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "bake/commands/bake_options.hpp"
#include "bake/project/settings.hpp"
#include "formats/base/atomic_file.hpp"
#include "tests/texture/texture_samples.hpp"

namespace modar {
namespace {

std::string stated(const BakeRequest& request) {
  return state_options(request).dump();
}

bool is_truth(const BakeOption& option) {
  const auto* word = std::get_if<WordOption>(&option.value);
  return std::holds_alternative<TruthOption>(option.value) || (word != nullptr && word->truth);
}

/// The request of `modar bake` with one option, whose value is the example of its row.
BakeRequest by_command_line(const BakeOption& option) {
  BakeRequest request;
  OptionTexts texts;
  CommandLine line("test", "1");
  for (const OptionGroup group : {OptionGroup::kTarget, OptionGroup::kGeometry,
                                  OptionGroup::kTextures, OptionGroup::kPatterns}) {
    add_bake_options(line, group, request, texts);
  }
  line.run([&]() -> Result<ExitCode> {
    MODAR_TRY(take_texts(texts, request));
    return ExitCode::kOk;
  });
  const std::string flag = option.flag;
  std::string name = flag.substr(0, flag.find(','));
  std::string value = option.example;
  std::string program = "modar";
  std::vector<char*> words = {program.data(), name.data()};
  if (!is_truth(option)) words.push_back(value.data());
  EXPECT_EQ(line.parse_and_run(static_cast<int>(words.size()), words.data()), 0) << flag;
  return request;
}

/// That of a project file with its key.
BakeRequest by_project(const BakeOption& option) {
  test::ScratchFolder folder;
  EXPECT_TRUE(write_file(folder.file("a.obj"), std::string_view("v 0 0 0\n")));
  EXPECT_TRUE(write_file(folder.file("room.hdr"), std::string_view("")));
  const bool plain = is_truth(option) || std::holds_alternative<NumberOption>(option.value);
  const std::string quote = plain ? "" : "\"";
  const std::string table = option.part == OptionPart::kProject ? "[project]\n" : "[bake]\n";
  const std::string line = std::string(option.name) + " = " + quote + option.example + quote + "\n";
  const std::string text = table + line + "[[model]]\nfile = \"a.obj\"\n";
  EXPECT_TRUE(write_file(folder.file("modar.toml"), std::string_view(text)));
  const auto project = read_project(folder.file("modar.toml"));
  BakeRequest request;
  if (!project) {
    ADD_FAILURE() << to_line(project.error());
    return request;
  }
  EXPECT_TRUE(apply_settings(project->settings, request));
  request.light = project->light;
  return request;
}

TEST(Options, EveryRowHasNamesOfItsOwn) {
  std::set<std::string> flags;
  std::set<std::string> keys;
  std::set<std::string> members;
  for (const BakeOption& option : bake_options()) {
    EXPECT_TRUE(std::string(option.flag).starts_with("--") && flags.insert(option.flag).second);
    EXPECT_TRUE(*option.name != 0 && keys.insert(option.name).second) << option.flag;
    EXPECT_TRUE(*option.name != 0 && members.insert(option.name).second) << option.flag;
    EXPECT_GT(std::string(option.help).size(), 10U) << option.flag;
  }
  EXPECT_GE(keys.size(), 19U);
}

TEST(Options, TheCommandLineAndTheProjectFileSayTheSame) {
  for (const BakeOption& option : bake_options()) {
    const std::string said = stated(by_command_line(option));
    EXPECT_EQ(said, stated(by_project(option))) << option.flag;
    EXPECT_NE(said, stated({})) << option.flag;
  }
}

TEST(Options, WhatIsStatedComesBack) {
  for (const BakeOption& option : bake_options()) {
    const std::string said = stated(by_command_line(option));
    BakeRequest again;
    again.patterns = {{"rooms/room.hdr"}};
    restore_options(Json::parse(said), again);
    EXPECT_EQ(stated(again), said) << option.flag;
  }
}

TEST(Options, ThatNothingWasChosenComesBack) {
  const std::string plain = stated({});
  for (const BakeOption& option : bake_options()) {
    if (!std::holds_alternative<WordOption>(option.value)) continue;
    BakeRequest again = by_command_line(option);
    restore_options(Json::parse(plain), again);
    EXPECT_EQ(stated(again), plain) << option.flag;
  }
}

TEST(Options, WrongMetaTextsChangeNothing) {
  for (const BakeOption& option : bake_options()) {
    for (const char* wrong : {"-1", "4294967296", "1e300", "\"moon\"", "{}", "null"}) {
      BakeRequest request;
      restore_options(
          Json::parse("{\"" + std::string(option.name) + "\": " + std::string(wrong) + "}"),
          request);
      const bool any_number =
          std::string(option.name) == "max-error" || std::string(option.name) == "unit";
      if (any_number) continue;
      EXPECT_EQ(stated(request), stated({})) << option.name << " " << wrong;
    }
  }
}

TEST(Options, SizesOfDevicesAndTiersHoldWhateverTheOrder) {
  BakeRequest request;
  ASSERT_TRUE(
      apply_settings({{"device", "mali400"}, {"max-texture", "8192"}, {"tier", "thumb"}}, request));
  EXPECT_EQ(request.textures.max_side, 512U);
}

TEST(Options, DevicesWithoutHalfFloatsGetIntegers) {
  BakeRequest without;
  ASSERT_TRUE(apply_settings({{"device", "mali400"}}, without));
  EXPECT_EQ(without.positions, PositionKind::kInt16);
  BakeRequest with;
  ASSERT_TRUE(apply_settings({{"device", "ace2"}}, with));
  EXPECT_EQ(with.positions, std::nullopt);
  BakeRequest asked;
  ASSERT_TRUE(apply_settings({{"positions", "half"}, {"device", "mali400"}}, asked));
  EXPECT_EQ(asked.positions, PositionKind::kHalf);
}

}  // namespace
}  // namespace modar
