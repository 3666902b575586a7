// Moving models: poses against double precision, and pictures against those of a model whose
// vertices the test has moved.
#include <array>
#include <cmath>
#include <cstring>
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

/// The moving model with two morph targets, whose weights are 0.8 and -0.5, or with its vertices
/// stored where these move them.
BundleContent morphed_content(bool stored) {
  constexpr double kFar[] = {0.3, 0.2};
  constexpr double kWeight[] = {0.8, -0.5};
  BundleContent content = moving_content();
  LayoutRecord& layout = content.layouts[0];
  std::copy_n(layout.attributes + 3, 2, layout.attributes + 2);  // instead of the colour
  layout.attributes[4] = {};
  layout.attribute_count = 4;
  for (int axis = 0; axis < 3 && !stored; ++axis) {
    layout.attributes[layout.attribute_count++] = {
        static_cast<std::uint8_t>(8 + axis), 2, 2, 0, static_cast<std::uint16_t>(28 + 4 * axis), 0};
  }
  const std::size_t moving = std::size_t{content.levels[0].vertex_count} * layout.stride;
  std::vector<std::byte> vertices;
  for (std::size_t v = 0; v < content.vertices.size(); v += layout.stride) {
    std::array<std::byte, 40> vertex{};
    std::memcpy(vertex.data(), &content.vertices[v], layout.stride);
    std::memset(vertex.data() + 16, 0, 4);
    std::array<float, 3> at{};
    std::memcpy(at.data(), vertex.data(), sizeof at);
    const auto y = static_cast<double>(at[1]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t t = 0; t < 2; ++t) {
        const double phase = static_cast<double>(axis + 2 * t);
        const auto way = static_cast<std::int16_t>(std::lround(32767 * std::sin(4 * y + phase)));
        std::memcpy(vertex.data() + 28 + 4 * axis + 2 * t, &way, sizeof way);
        at[axis] += static_cast<float>(kFar[t] * kWeight[t] * way / 32767);
      }
    }
    if (stored) std::memset(vertex.data() + 28, 0, 12);
    if (stored && v >= moving) std::memcpy(vertex.data(), at.data(), sizeof at);
    vertices.insert(vertices.end(), vertex.begin(), vertex.end());
  }
  content.vertices = vertices;
  layout.stride = 40;
  for (LevelRecord& level : content.levels) level.vertex_offset = level.vertex_offset / 28 * 40;
  for (ChunkRecord& chunk : content.chunks) {
    std::fill_n(chunk.bounds_min, 3, -3.0f);
    std::fill_n(chunk.bounds_max, 3, 3.0f);
  }
  if (stored) return content;
  const auto own = content.bones;
  for (std::size_t t = 0; t < 2; ++t) {
    JointRecord joint{};
    joint.parent = kNone;
    joint.before[0] = static_cast<float>(kFar[t]);
    joint.translation[0] = static_cast<float>(kWeight[t]);
    joint.rotation[3] = 1;
    BoneRecord bone{};
    bone.joint = static_cast<std::uint32_t>(content.joints.size());
    for (int i = 0; i < 3; ++i) bone.inverse[5 * i] = 1;
    content.joints.push_back(joint);
    content.bones.insert(content.bones.begin() + 1 + static_cast<std::ptrdiff_t>(t), bone);
    content.bones.push_back(bone);
  }
  content.parts[1].first_bone += 2;
  for (PartRecord& part : content.parts) part.target_count = 2;
  return content;
}

TEST_F(MovingPictureTest, MorphTargetsMoveVerticesBeforeBones) {
  const MappedBundle moving(morphed_content(false));
  const MappedBundle still(morphed_content(true));
  const auto masked = mask_gl_caps(probe_gl_caps(), "mali400");
  for (const GlCaps& caps : {probe_gl_caps(), *masked}) {
    for (const float stretch : {1.0f, 1.3f}) {
      const auto picture = [&](const BundleView& bundle) {
        ClipPlayer player(bundle, 0);
        player.play(0, true, 0);
        player.advance(0.35);
        player.pose();
        const auto renderer = make_renderer(bundle, caps);
        renderer->set_options(flat_light());
        DrawItem item{0, glm::scale(before_eye(), glm::vec3(stretch, 1.0f, 1.0f)), kNone,
                      glm::mat4(1.0f)};
        item.bones = player.bones().data();
        const auto hit = pick(bundle, camera_above(256), {140, 120}, {&item, 1});
        return std::pair(draw(*renderer, camera_above(256), {&item, 1}), hit->point);
      };
      const auto [found, point] = picture(*moving.view);
      const auto [expected, wanted] = picture(*still.view);
      EXPECT_LE(different(found, expected), 10);
      EXPECT_LT(glm::length(point - wanted), 1e-4f);
    }
  }
}

/// Boxes hold vertices in any pose, that between two clips too: a ray and the frustum find them.
TEST_F(MovingPictureTest, BoxesHoldPosesOfNoClip) {
  BundleContent content = moving_content();
  for (PartRecord& part : content.parts) {
    std::fill_n(part.bounds_min, 3, -0.01f);  // as if no clip left that
    std::fill_n(part.bounds_max, 3, 0.01f);
  }
  const MappedBundle moving(content);
  const MappedBundle still(posed_content(bone_matrices(joint_states(0, 0.35))));
  ClipPlayer player(*moving.view, 0);
  player.play(0, true, 0);
  player.advance(0.35);
  player.pose();
  DrawItem item{0, before_eye(), kNone, glm::mat4(1.0f)};
  // The picture shows a part far from the middle alone.
  for (const float aside : {-0.55f, 0.6f}) {
    item.to_eye = glm::translate(glm::mat4(1.0f), glm::vec3(-8 * aside, 0, 0)) *
                  glm::scale(before_eye(), glm::vec3(8.0f));
    item.bones = nullptr;
    const auto reference = make_renderer(*still.view, probe_gl_caps());
    const auto renderer = make_renderer(*moving.view, probe_gl_caps());
    reference->set_options(flat_light());
    renderer->set_options(flat_light());
    const auto expected = draw(*reference, camera_above(256), {&item, 1});
    item.bones = player.bones().data();
    EXPECT_LE(different(draw(*renderer, camera_above(256), {&item, 1}), expected), 400);
  }
  const DrawItem posed{0, before_eye()};
  const DepthRange wanted = depth_range(*still.view, {&posed, 1});
  item.to_eye = before_eye();
  const DepthRange range = depth_range(*moving.view, {&item, 1});
  EXPECT_LE(range.near_plane, wanted.near_plane + 1e-4);
  EXPECT_GE(range.far_plane, wanted.far_plane - 1e-4);
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
