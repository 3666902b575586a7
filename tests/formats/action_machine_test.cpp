// The state machine, held against *The state machine* of bundle.md.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "formats/action_machine.hpp"
#include "tests/formats/allocation_counter.hpp"
#include "tests/formats/support.hpp"

namespace {

using namespace modar;
using namespace modar::test;

constexpr SceneEvent kSeen = {SceneEvent::Kind::kSeen, 0, kNone};
constexpr std::uint32_t kPot = 0;
constexpr std::uint32_t kMap = 1;
constexpr std::uint32_t kRim = 2;
constexpr std::uint32_t kTrailer = 3;

SceneEvent tap(std::uint32_t node, std::uint32_t material = kNone) {
  return {SceneEvent::Kind::kTap, node, material};
}

/// A bundle of the nodes of add_nodes(), and of actions of its own.
class ActionTest : public ::testing::Test {
 protected:
  ActionTest() : content_(acting_content()) { content_.actions.clear(); }

  ActionRecord& add(ActionEvent event, std::uint32_t source, ActionCommand command,
                    std::uint32_t target) {
    ActionRecord action{};
    action.event = static_cast<std::uint32_t>(event);
    action.command = static_cast<std::uint32_t>(command);
    action.source = source;
    action.target = target;
    return content_.actions.emplace_back(action);
  }

  ActionMachine& machine() {
    bytes_ = encode(content_);
    auto view = BundleView::open(bytes_);
    EXPECT_TRUE(view) << to_line(view.error());
    machine_.emplace(*view);
    return *machine_;
  }

  /// "PMR": which of pot, map and rim are shown.
  std::string shown() const {
    std::string text;
    for (std::uint32_t i = 0; i < 3; ++i) text += machine_->shown(i) ? "PMR"[i] : '.';
    return text;
  }

  std::string after(double time, std::vector<SceneEvent> events) {
    machine_->step(time, events);
    return shown();
  }

  BundleContent content_;
  Bytes bytes_;
  std::optional<ActionMachine> machine_;
};

TEST_F(ActionTest, FoundAndLostFireOnceWithASecondOfGrace) {
  add(ActionEvent::kFound, 0, ActionCommand::kToggle, kMap);
  add(ActionEvent::kLost, 0, ActionCommand::kToggle, kRim);
  machine();
  EXPECT_EQ(shown(), "P.R");
  EXPECT_EQ(after(10.0, {}), "P.R");
  EXPECT_EQ(after(10.1, {kSeen}), "PMR");
  EXPECT_EQ(after(10.2, {kSeen}), "PMR");  // found once
  EXPECT_EQ(after(11.2, {}), "PMR");       // exactly a second: not more
  EXPECT_EQ(after(11.3, {}), "PM.");
  EXPECT_EQ(after(13.0, {}), "PM.");  // lost once
  EXPECT_EQ(after(13.1, {kSeen}), "P..");
  EXPECT_EQ(after(13.9, {}), "P..");
  EXPECT_EQ(after(14.0, {kSeen}), "P..");  // it was away for less than a second
  machine_->reset();
  EXPECT_EQ(shown(), "P.R");
  EXPECT_EQ(after(0.0, {kSeen}), "PMR");
}

TEST_F(ActionTest, DelaysCountFromFoundAndFireOnce) {
  add(ActionEvent::kAfter, 0, ActionCommand::kToggle, kMap).seconds = 2.5f;
  machine();
  EXPECT_FALSE(machine_->waiting());
  EXPECT_EQ(after(1.0, {kSeen}), "P.R");
  EXPECT_TRUE(machine_->waiting());
  EXPECT_EQ(after(3.4, {kSeen}), "P.R");
  EXPECT_EQ(after(3.5, {kSeen}), "PMR");
  EXPECT_FALSE(machine_->waiting());
  EXPECT_EQ(after(9.0, {kSeen}), "PMR");
  EXPECT_EQ(after(2.0, {kSeen}), "PMR");  // a time that falls counts as the last one
  EXPECT_EQ(after(10.5, {}), "PMR");      // lost: the delay begins anew
  EXPECT_EQ(after(20.0, {kSeen}), "PMR");
  EXPECT_EQ(after(22.5, {kSeen}), "P.R");
}

TEST_F(ActionTest, TapsCountOnWhatIsShownAndByPart) {
  add(ActionEvent::kTap, kPot, ActionCommand::kShow, kMap).part = content_.intern("skin");
  add(ActionEvent::kTap, kPot, ActionCommand::kHide, kRim);
  add(ActionEvent::kTap, kMap, ActionCommand::kHide, kPot);
  machine();
  EXPECT_EQ(after(0.0, {tap(kPot, 0)}), "P.R");         // nothing is on the screen
  EXPECT_EQ(after(0.1, {kSeen, tap(kMap)}), "P.R");     // hidden
  EXPECT_EQ(after(0.2, {kSeen, tap(kPot, 1)}), "P..");  // its other material
  EXPECT_EQ(after(0.3, {kSeen, tap(kPot, 0)}), "PM.");
  EXPECT_EQ(after(0.4, {kSeen, tap(kMap), tap(77)}), ".M.");
}

TEST_F(ActionTest, AnActionFiresOnceAStepInOrderOfTheTable) {
  add(ActionEvent::kTap, kPot, ActionCommand::kToggle, kMap);
  add(ActionEvent::kTap, kPot, ActionCommand::kToggle, kRim);
  add(ActionEvent::kFound, 0, ActionCommand::kHide, kRim);
  machine();
  // Found comes before taps, whatever the order of the table.
  EXPECT_EQ(after(0.0, {tap(kPot), kSeen, tap(kPot)}), "PMR");
}

TEST_F(ActionTest, NextCyclesTheGroup) {
  add(ActionEvent::kTap, kRim, ActionCommand::kNext, kMap);
  machine();
  EXPECT_EQ(after(0.0, {kSeen, tap(kRim)}), ".MR");
  EXPECT_EQ(after(0.1, {kSeen, tap(kRim)}), "P.R");
  EXPECT_EQ(after(0.2, {kSeen, tap(kRim)}), ".MR");
}

TEST_F(ActionTest, WordsAndLinksAreCommandsOfTheApp) {
  add(ActionEvent::kTap, kPot, ActionCommand::kLink, kNone).address =
      content_.intern("https://museum.org/pot");
  add(ActionEvent::kFound, 0, ActionCommand::kText, kRim);
  content_.nodes[kTrailer].flags = 0;
  machine();
  auto commands = machine_->step(0.0, std::vector{kSeen, tap(kPot)});
  ASSERT_EQ(commands.size(), 2u);
  EXPECT_EQ(commands[0].command, ActionCommand::kText);
  EXPECT_EQ(commands[0].node, kRim);
  EXPECT_EQ(commands[1].command, ActionCommand::kLink);
  EXPECT_EQ(commands[1].action, 0u);
  // A label that is no action's source tells its words, once a step.
  commands = machine_->step(0.1, std::vector{kSeen, tap(kRim), tap(kRim)});
  ASSERT_EQ(commands.size(), 1u);
  EXPECT_EQ(commands[0].node, kRim);
  EXPECT_EQ(commands[0].action, kNone);
}

TEST_F(ActionTest, TurnsAddUp) {
  ActionRecord& turn = add(ActionEvent::kTap, kPot, ActionCommand::kTurn, kPot);
  turn.axis[2] = 1;
  turn.degrees = 60;
  turn.duration = 2;
  ActionRecord& other = add(ActionEvent::kTap, kRim, ActionCommand::kTurn, kPot);
  other.axis[0] = 1;
  other.degrees = 180;
  machine();
  const auto angle = [&] {
    return 2 * std::acos(static_cast<double>(machine_->turn_of(kPot).w)) * 180 / M_PI;
  };
  machine_->step(5.0, std::vector{kSeen, tap(kPot)});
  EXPECT_NEAR(angle(), 0, 1e-3);
  EXPECT_TRUE(machine_->waiting());
  machine_->step(5.5, std::vector{kSeen});
  EXPECT_NEAR(angle(), 15, 1e-3);
  EXPECT_GT(machine_->turn_of(kPot).z, 0);
  machine_->step(6.0, std::vector{kSeen, tap(kPot)});  // the first turn ends at once
  EXPECT_NEAR(angle(), 60, 1e-3);
  machine_->step(9.0, std::vector{kSeen});
  EXPECT_NEAR(angle(), 120, 1e-3);
  EXPECT_FALSE(machine_->waiting());
  // A half turn about x after 120 degrees about z: x y z w of the product, computed on paper.
  machine_->step(9.1, std::vector{kSeen, tap(kRim)});
  const NodeTurn both = machine_->turn_of(kPot);
  EXPECT_NEAR(both.x, 0.5, 1e-6);
  EXPECT_NEAR(both.y, -std::sqrt(0.75), 1e-6);
  EXPECT_NEAR(both.z, 0, 1e-6);
  EXPECT_NEAR(both.w, 0, 1e-6);
}

/// The videos' commands: "+3" plays, "-3" pauses.
std::string told(std::span<const SceneCommand> commands) {
  std::string text;
  for (const SceneCommand& command : commands) {
    text += (command.command == ActionCommand::kPlay ? "+" : "-") + std::to_string(command.node);
  }
  return text;
}

TEST_F(ActionTest, VideosPlayWhileTheyAreWantedAndSeen) {
  add(ActionEvent::kTap, kRim, ActionCommand::kPause, kTrailer);
  add(ActionEvent::kTap, kMap, ActionCommand::kPlay, kTrailer);
  add(ActionEvent::kTap, kPot, ActionCommand::kToggle, kTrailer);
  content_.nodes[kMap].flags = 0;
  machine();
  const auto step = [&](double time, const std::vector<SceneEvent>& events) {
    return told(machine_->step(time, events));
  };
  EXPECT_EQ(step(0, {}), "");
  EXPECT_EQ(step(1, {kSeen}), "+3");
  EXPECT_EQ(step(1.1, {kSeen}), "");
  EXPECT_EQ(step(2.1, {}), "");  // a second of grace
  EXPECT_EQ(step(2.2, {}), "-3");
  EXPECT_EQ(step(5, {kSeen}), "+3");  // it continues
  EXPECT_EQ(step(5.1, {kSeen, tap(kRim)}), "-3");
  EXPECT_EQ(step(7, {}), "");
  EXPECT_EQ(step(8, {kSeen}), "");  // paused by the visitor
  EXPECT_EQ(step(8.1, {kSeen, tap(kMap)}), "+3");
  EXPECT_EQ(step(8.2, {kSeen, tap(kPot)}), "-3");  // hidden
  EXPECT_EQ(step(8.3, {kSeen, tap(kPot)}), "+3");
  EXPECT_EQ(step(9, {kSeen, {SceneEvent::Kind::kEnded, kTrailer, kNone}}), "");
  EXPECT_EQ(step(9.1, {kSeen, tap(kMap)}), "+3");
}

TEST_F(ActionTest, AStepAllocatesNothing) {
  for (std::uint32_t i = 0; i < kMostActions; ++i)
    add(ActionEvent::kTap, kRim, ActionCommand::kText, kRim);
  machine();
  const std::vector<SceneEvent> events = {kSeen, tap(kRim), tap(kRim), tap(kPot)};
  const std::size_t before = allocation_count();
  for (int i = 0; i < 50; ++i) machine_->step(i, events);
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace
