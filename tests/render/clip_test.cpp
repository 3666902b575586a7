// Moving models: poses against double precision, and pictures against those of a model whose
// vertices the test has moved.
#include <cmath>
#include <random>

#include <glm/gtc/matrix_transform.hpp>

#include "modar/clip_player.hpp"
#include "tests/render/moving_model.hpp"

namespace modar::test {
namespace {

/// Packed quaternions and ranges, through several joints; model space.
constexpr double kPackedError = 3e-4;

void expect_bones(std::span<const BoneMatrix> bones, const std::vector<JointState>& states) {
  const auto expected = bone_matrices(states);
  ASSERT_EQ(bones.size(), expected.size());
  for (std::size_t b = 0; b < bones.size(); ++b) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        EXPECT_NEAR(static_cast<double>(bones[b][row][column]), expected[b][column][row],
                    kPackedError)
            << "bone " << b << ", row " << row << ", column " << column;
      }
    }
  }
}

class ClipTest : public testing::Test {
 protected:
  const MappedBundle bundle_{moving_content()};
  ClipPlayer player_{*bundle_.view, 0};
};

TEST_F(ClipTest, IsAtRestBeforeAClip) {
  EXPECT_TRUE(player_.bones().empty());
  player_.advance(1);
  player_.pose();
  EXPECT_TRUE(player_.bones().empty());
  EXPECT_EQ(player_.playing(), kNone);
}

TEST_F(ClipTest, PosesFollowTheCurves) {
  std::mt19937 random(7);
  ASSERT_TRUE(player_.play(0, true, 0));
  double time = 0;
  for (int frame = 0; frame < 200; ++frame) {
    player_.pose();
    expect_bones(player_.bones(), joint_states(0, std::fmod(time, kFirstSeconds)));
    const double step = frame % 7 == 0 ? 0.7 : static_cast<double>(random() % 100) / 1500;
    player_.advance(step);
    time += step;
    EXPECT_EQ(player_.playing(), 0u);
  }
}

TEST_F(ClipTest, KeepsItsLastPose) {
  ASSERT_TRUE(player_.play(1, false, 0));
  player_.advance(0.49);
  EXPECT_EQ(player_.playing(), 1u);
  player_.advance(0.4);
  EXPECT_EQ(player_.playing(), kNone);
  player_.pose();
  expect_bones(player_.bones(), joint_states(1, kSecondSeconds));
  EXPECT_FALSE(player_.moves());
}

TEST_F(ClipTest, BlendsTwoClipsThatBothMove) {
  ASSERT_TRUE(player_.play(0, true, 0));
  player_.advance(0.4);
  ASSERT_TRUE(player_.play(1, true, kClipBlendSeconds));
  for (double time = 0; time < 0.45; time += 0.05) {
    player_.pose();
    const double share = std::min(1.0, time / kClipBlendSeconds);
    expect_bones(player_.bones(),
                 blended(joint_states(0, 0.4 + time), joint_states(1, time), share));
    player_.advance(0.05);
  }
}

TEST_F(ClipTest, BeginsFromTheRestPose) {
  ASSERT_TRUE(player_.play(1, true, 0.3));
  player_.advance(0.1);
  player_.pose();
  std::vector<JointState> rest = joint_states(1, 0);
  rest[1].rotation = {1, 0, 0, 0};  // the other curves begin at rest
  expect_bones(player_.bones(), blended(rest, joint_states(1, 0.1), 1.0 / 3));
}

TEST_F(ClipTest, DoesNotJumpWhenABlendIsInterrupted) {
  ASSERT_TRUE(player_.play(0, true, 0));
  player_.advance(0.4);
  ASSERT_TRUE(player_.play(1, true, 0.3));
  player_.advance(0.15);
  player_.pose();
  const std::vector<BoneMatrix> before(player_.bones().begin(), player_.bones().end());
  ASSERT_TRUE(player_.play(0, true, 0.3));
  player_.pose();
  for (std::size_t b = 0; b < before.size(); ++b) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column)
        EXPECT_NEAR(player_.bones()[b][row][column], before[b][row][column], 1e-5f);
    }
  }
}

TEST_F(ClipTest, StopsWhereItIs) {
  ASSERT_TRUE(player_.play(0, true, 0));
  player_.advance(0.3);
  player_.stop();
  player_.advance(0.3);
  player_.pose();
  expect_bones(player_.bones(), joint_states(0, 0.3));
  EXPECT_EQ(player_.playing(), kNone);
}

TEST_F(ClipTest, RefusesClipsThatAreNotOfItsModel) {
  EXPECT_FALSE(player_.play(2, true, 0));
  EXPECT_FALSE(player_.play(kNone, true, 0));
}

// ---- pictures

glm::mat4 before_eye(double degrees = 20) {
  glm::mat4 matrix = glm::translate(glm::mat4(1.0f), glm::vec3(0.0f, 0.0f, -5.0f));
  return glm::rotate(matrix, static_cast<float>(glm::radians(degrees)), glm::vec3(0.3f, 1.0f, 0));
}

/// Pixels that differ by more than 2 of 255; both pictures hold something.
int different(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  int count = 0;
  int filled = 0;
  for (std::size_t i = 0; i < a.size(); i += 4) {
    bool same = true;
    for (std::size_t c = 0; c < 3; ++c)
      same = same && std::abs(static_cast<int>(a[i + c]) - static_cast<int>(b[i + c])) <= 2;
    count += same ? 0 : 1;
    filled += b[i] > 50 || b[i + 1] > 50 || b[i + 2] > 50 ? 1 : 0;
  }
  EXPECT_GT(filled, 2000);
  return count;
}

class MovingPictureTest : public GlTest {
 protected:
  /// The moving model and the moved one in the same light. at: seconds of the first clip.
  void compare(double at, const GlCaps& caps, const glm::mat4& to_eye,
               const RenderOptions& options = flat_light()) {
    const MappedBundle moving(moving_content());
    const MappedBundle still(posed_content(bone_matrices(joint_states(0, at))));
    ClipPlayer player(*moving.view, 0);
    ASSERT_TRUE(player.play(0, true, 0));
    player.advance(at);
    player.pose();
    const Camera camera = camera_above(256);
    const auto renderer = make_renderer(*moving.view, caps);
    const auto reference = make_renderer(*still.view, caps);
    ASSERT_TRUE(renderer && reference);
    renderer->set_options(options);
    reference->set_options(options);
    DrawItem item{0, to_eye, kNone, glm::mat4(1.0f)};
    const auto expected = draw(*reference, camera, {&item, 1});
    const auto rest = draw(*renderer, camera, {&item, 1});
    item.bones = player.bones().data();
    const auto picture = draw(*renderer, camera, {&item, 1});
    EXPECT_GT(different(picture, rest), 2000);
    // Along edges: positions are packed.
    EXPECT_LE(different(picture, expected), 40) << at;
  }
};

TEST_F(MovingPictureTest, IsThatOfAModelWithMovedVertices) {
  for (const double at : {0.1, 0.35, 0.8}) compare(at, probe_gl_caps(), before_eye());
}

TEST_F(MovingPictureTest, IsTheSameOnASmallDevice) {
  const auto masked = mask_gl_caps(probe_gl_caps(), "mali400");
  ASSERT_TRUE(masked.has_value());
  for (const double at : {0.1, 0.35, 0.8}) compare(at, *masked, before_eye());
}

/// The matrix changes angles: another way to draw.
TEST_F(MovingPictureTest, IsTheSameInAStretchedItem) {
  compare(0.35, probe_gl_caps(), glm::scale(before_eye(), glm::vec3(1.3f, 0.8f, 1.0f)));
}

/// Two scenes with one model, each at its own time, are those of two moved models.
TEST_F(MovingPictureTest, DrawsTwoItemsOfAModelAtTheirOwnTimes) {
  const MappedBundle moving(moving_content());
  ClipPlayer first(*moving.view, 0);
  ClipPlayer second(*moving.view, 0);
  const glm::mat4 left = glm::translate(before_eye(), glm::vec3(-0.6f, 0, 0));
  const glm::mat4 right = glm::translate(before_eye(), glm::vec3(0.6f, 0, -0.5f));
  first.play(0, true, 0);
  second.play(0, true, 0);
  first.advance(0.2);
  second.advance(0.7);
  first.pose();
  second.pose();
  const glm::mat4 world(1.0f);
  DrawItem items[] = {{0, left, kNone, world}, {0, right, kNone, world}};
  items[0].bones = first.bones().data();
  items[1].bones = second.bones().data();
  const Camera camera = camera_above(256);
  const auto renderer = make_renderer(*moving.view, probe_gl_caps());
  const auto together = draw(*renderer, camera, items);
  BundleContent content = posed_content(bone_matrices(joint_states(0, 0.2)));
  const MappedBundle one(content);
  const MappedBundle two(posed_content(bone_matrices(joint_states(0, 0.7))));
  const auto draw_one = make_renderer(*one.view, probe_gl_caps());
  const auto draw_two = make_renderer(*two.view, probe_gl_caps());
  const DrawItem alone[] = {{0, left, kNone, world}, {0, right, kNone, world}};
  const auto a = draw(*draw_one, camera, {&alone[0], 1});
  const auto b = draw(*draw_two, camera, {&alone[1], 1});
  int wrong = 0;
  for (std::size_t i = 0; i < together.size(); i += 4) {
    const auto is = [&](const std::vector<std::uint8_t>& other) {
      for (std::size_t c = 0; c < 3; ++c)
        if (std::abs(static_cast<int>(together[i + c]) - static_cast<int>(other[i + c])) > 2)
          return false;
      return true;
    };
    wrong += is(a) || is(b) ? 0 : 1;
  }
  EXPECT_LE(wrong, 40);
  EXPECT_GT(different(together, a), 500);
  EXPECT_GT(different(together, b), 500);
}

/// A ray hits the moving model where it hits the moved one.
TEST(MovingPickTest, HitsWhatIsDrawn) {
  const MappedBundle moving(moving_content());
  const MappedBundle still(posed_content(bone_matrices(joint_states(0, 0.35))));
  ClipPlayer player(*moving.view, 0);
  player.play(0, true, 0);
  player.advance(0.35);
  player.pose();
  const Camera camera = camera_above(64);
  DrawItem item{0, before_eye()};
  DrawItem posed = item;
  posed.bones = player.bones().data();
  int hits = 0;
  for (int y = 0; y < 64; y += 3) {
    for (int x = 0; x < 64; x += 3) {
      const auto expected = pick(*still.view, camera, glm::dvec2(x, y), {&item, 1});
      const auto found = pick(*moving.view, camera, glm::dvec2(x, y), {&posed, 1});
      if (!expected || !found) continue;
      hits += expected->material != 0 ? 1 : 0;
      EXPECT_EQ(found->material, expected->material);
      EXPECT_LT(glm::length(found->point - expected->point), 2e-3f);
    }
  }
  EXPECT_GT(hits, 20);
}

}  // namespace
}  // namespace modar::test
