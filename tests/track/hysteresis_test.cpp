// The two-frame rule as tables: S is a frame with a detection, a dot one without.
#include <gtest/gtest.h>

#include "modar/tracker.hpp"

namespace modar {
namespace {

std::string shown(const std::string& frames) {
  Hysteresis hysteresis(1);
  std::string answer;
  for (const char frame : frames) {
    std::vector<Detection> visible(frame == 'S' ? 1 : 0);
    answer += hysteresis.step(visible)[0].shown ? '1' : '0';
  }
  return answer;
}

TEST(Hysteresis, FollowsTheArticlesRule) {
  EXPECT_EQ(shown("SSSS"), "0111");
  EXPECT_EQ(shown("S.S.S."), "000000");
  EXPECT_EQ(shown("SS...."), "011100");
  EXPECT_EQ(shown("SS..S...."), "011111100");
  EXPECT_EQ(shown("SS...S.SS"), "011100001");
  EXPECT_EQ(shown("......"), "000000");
}

TEST(Hysteresis, WithoutPredictionKeepsTheNewestPoseAndSaysWhetherItIsOfThisFrame) {
  Hysteresis hysteresis(2, false);
  Detection detection;
  detection.pattern = 1;
  detection.pose.translation = {1, 2, 3};
  hysteresis.step({&detection, 1});
  detection.pose.translation = {4, 5, 6};
  auto states = hysteresis.step({&detection, 1});
  EXPECT_FALSE(states[0].shown);
  EXPECT_TRUE(states[1].shown);
  EXPECT_TRUE(states[1].measured);
  states = hysteresis.step({});
  EXPECT_TRUE(states[1].shown);
  EXPECT_FALSE(states[1].measured);
  EXPECT_EQ(states[1].pose.translation, glm::dvec3(4, 5, 6));
}

TEST(Hysteresis, CopiesOfAPatternAreApart) {
  Hysteresis hysteresis(2, true, true, 3);
  std::array<Detection, 2> seen;
  seen[0].pattern = 1;
  seen[1].pattern = 1;
  seen[1].copy = 2;
  seen[1].pose.translation = {7, 8, 9};
  const auto states = hysteresis.step(seen);
  ASSERT_EQ(states.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(states[i].shown, i == 1 || i == 5) << i;
  EXPECT_EQ(states[5].pose.translation, glm::dvec3(7, 8, 9));
}

TEST(Hysteresis, GoesOnAsThePatternMovedBeforeItsLoss) {
  Hysteresis hysteresis(1);
  Detection detection;
  const auto see = [&](double x, double turn) {
    detection.pose.translation = {x, 2, 8};
    detection.pose.rotation = rotation_matrix({0, turn, 0});
    return hysteresis.step({&detection, 1})[0];
  };
  see(1.0, 0.3);
  see(1.5, 0.4);
  for (const int missed : {1, 2}) {
    const Hysteresis::State state = hysteresis.step({})[0];
    EXPECT_TRUE(state.shown);
    EXPECT_FALSE(state.measured);
    EXPECT_NEAR(state.pose.translation.x, 1.5 + 0.5 * missed, 1e-12);
    EXPECT_NEAR(rotation_vector(state.pose.rotation).y, 0.4 + 0.1 * missed, 1e-9);
  }
  EXPECT_FALSE(hysteresis.step({})[0].shown);
  // One frame tells no motion.
  see(3.0, 0);
  EXPECT_EQ(hysteresis.step({})[0].pose.translation.x, 3.0);
}

TEST(Hysteresis, IgnoresPatternsThatItDoesNotKnow) {
  Hysteresis hysteresis(1);
  Detection detection;
  detection.pattern = 9;
  hysteresis.step({&detection, 1});
  EXPECT_FALSE(hysteresis.step({&detection, 1})[0].shown);
}

TEST(Reason, EveryReasonHasItsWords) {
  EXPECT_STREQ(to_string(Reason::kVisible), "visible");
  EXPECT_STREQ(to_string(Reason::kNoFeatures), "no features");
  EXPECT_STREQ(to_string(Reason::kFewMatches), "few matches");
  EXPECT_STREQ(to_string(Reason::kNoGeometry), "not in view");
  EXPECT_STREQ(to_string(Reason::kFailedVerification), "failed verification");
  EXPECT_STREQ(to_string(Reason::kLostByBlur), "lost by blur");
  EXPECT_STREQ(to_string(Reason::kOutOfView), "out of view");
}

}  // namespace
}  // namespace modar
